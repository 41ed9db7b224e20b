// The elements of the page by their names.

function byId(id) {
    return document.getElementById(id);
}

/** Does something at an event of an element, or of the one that has a name. */
function on(target, event, action) {
    (target.addEventListener ? target : byId(target)).addEventListener(event, action);
}

/** Changes a text; the same one again would be laid out again. */
function setText(element, text) {
    if (element.textContent !== text) element.textContent = text;
}
