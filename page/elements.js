// Access to the elements of the page.

function byId(id) {
    return document.getElementById(id);
}

/** What ends all listening. */
let listening = new AbortController();

/** Listens to an event of an element, or of the element with an id. */
function on(target, event, action, options) {
    (target.addEventListener ? target : byId(target)).addEventListener(event, action, { signal: listening.signal, ...options });
}

/** Ends all listening so far. */
function stopListening() {
    listening.abort();
    listening = new AbortController();
}

/** Makes an element with properties. */
function element(name, properties = {}) {
    return Object.assign(document.createElement(name), properties);
}

/** Sets the text of an element if it differs: setting it causes a new layout. */
function setText(element, text) {
    if (element.textContent !== text) element.textContent = text;
}
