// Access to the elements of the page.

function byId(id) {
    return document.getElementById(id);
}

/** Listens to an event of an element, or of the element with an id. */
function on(target, event, action, options) {
    (target.addEventListener ? target : byId(target)).addEventListener(event, action, options);
}

/** Makes an element with properties. */
function element(name, properties = {}) {
    return Object.assign(document.createElement(name), properties);
}

/** Sets the text of an element if it differs: setting it causes a new layout. */
function setText(element, text) {
    if (element.textContent !== text) element.textContent = text;
}
