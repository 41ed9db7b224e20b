//! The keys and gestures of the page and the window: one table, from which both make their help.

/// Where an input has its meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    Both,
    Page,
    Window,
}

/// An input and its meaning. Keys are between backticks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KeyHelp {
    pub(crate) place: Place,
    pub(crate) input: &'static str,
    pub(crate) meaning: &'static str,
}

const fn row(place: Place, input: &'static str, meaning: &'static str) -> KeyHelp {
    KeyHelp { place, input, meaning }
}

/// All inputs, in the order of the help.
pub(crate) const KEYS: [KeyHelp; 31] = [
    row(
        Place::Both,
        "Isovalue",
        "slider, curves, wheel with `Shift`; `,` `.` or `[` `]`, fine with `Shift`; `Page Up` `Page Down`; `Home` `End`; or type 37.2, 50% of the range, or, if there are statistics of the samples, p99 of them, 2.5sigma above their mean, top:1% of them",
    ),
    row(
        Place::Page,
        "Rotate",
        "drag; one finger; arrow keys, which step the isovalue on its slider",
    ),
    row(Place::Window, "Rotate", "drag; one finger; arrow keys"),
    row(
        Place::Both,
        "Move",
        "drag with the middle or right button; two fingers; `Shift` and arrow keys",
    ),
    row(Place::Page, "Zoom", "wheel (in another page with `Ctrl`); pinch; `+` `-`"),
    row(Place::Window, "Zoom", "wheel; both buttons; pinch; `+` `-`"),
    row(Place::Both, "Centre", "double click on the surface; outside it: the middle of the volume"),
    row(Place::Both, "`N` `P`", "next and previous isovalue with events"),
    row(Place::Both, "`Space`", "play the sweep through all isovalues"),
    row(Place::Both, "`Z` `V`", "fit the surface of this isovalue, or those of all isovalues"),
    row(Place::Both, "`R`", "the first view again"),
    row(Place::Window, "`Ctrl+Z` `Ctrl+Y`", "the previous view, the next one"),
    row(
        Place::Both,
        "`K` `X` `A`",
        "keep the component under the pointer alone, hide it; it is followed through the isovalue. `A` shows all again",
    ),
    row(
        Place::Both,
        "`C`",
        "colour the components, or not; other colours are in the list of colours",
    ),
    row(Place::Both, "`M`", "measure between two clicks on the surface"),
    row(Place::Both, "`W`", "wireframe: show the edges of the triangles"),
    row(Place::Both, "`B`", "close or open the surface at the border of the volume"),
    row(
        Place::Both,
        "`G`",
        "the box of the volume, the axes of the world, a scale bar in the unit of the spacing",
    ),
    row(
        Place::Page,
        "Slice",
        "in pages with samples: grey levels across an axis, isosurfaces as lines; the slider or the wheel moves it, a click shows the isosurface through a sample",
    ),
    row(
        Place::Page,
        "Look",
        "colours with map and scale; opacity; a clip plane; further isovalues that stay",
    ),
    row(
        Place::Both,
        "`1` `2` `3` `4` `5` `6`",
        "look from +x, -x, +y, -y, +z, -z; so does a click on the cube",
    ),
    row(Place::Both, "`O`", "parallel projection: sizes do not depend on depth"),
    row(Place::Both, "`D`", "dark hollows (ambient occlusion): show shape in spite of noise"),
    row(Place::Both, "`F`", "full screen"),
    row(
        Place::Page,
        "`S`",
        "save a picture, of the size and with the background chosen under Look; Film saves the sweep",
    ),
    row(Place::Window, "`S`", "save a picture"),
    row(Place::Window, "`Ctrl+S`", "save a picture, a mesh or the spectrum under a name"),
    row(Place::Window, "`Ctrl+O`", "open a spectrum or a volume"),
    row(
        Place::Page,
        "Open…",
        "a spectrum file (.isp) of this computer; or drop it on the page. It is not sent anywhere",
    ),
    row(Place::Window, "Drop", "files dropped on the window are opened, too"),
    row(Place::Both, "`H`", "this help"),
];

/// The keys of an input or a meaning: the words between backticks.
#[cfg(test)]
pub(crate) fn keys_of(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}
