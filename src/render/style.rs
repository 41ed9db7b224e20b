//! Named styles: background, light, colour and occlusion that suit each other.

use super::background::Background;
use super::light::Light;
use crate::color::linear;
use crate::parse_name::named_values;

/// A named style of pictures, pages and the window. [`Style::values`] is the only table of what each sets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Style {
    /// The look without a style.
    #[default]
    Default,
    /// For print: white, a muted colour, occlusion.
    Paper,
    /// For slides: dark, a warm colour, occlusion.
    Studio,
    /// Light from the eye, no occlusion: shades depend on the angle of the surface only.
    Flat,
}

named_values! {
    Style, "style":
    Default = "default",
    Paper = "paper",
    Studio = "studio",
    Flat = "flat",
}

/// What a style sets.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct StyleValues {
    /// The background; `None`: white in pictures, in a page that of the reader's browser.
    pub background: Option<Background>,
    /// The position of the main light.
    pub light: Light,
    /// Linear red, green and blue of the outer side of the first surface; `None` for the default colour.
    pub front: Option<[f32; 3]>,
    /// Whether ambient occlusion darkens hollows; `None`: not in pictures, in a page where the reader's GPU is fast enough.
    pub occlusion: Option<bool>,
}

impl Style {
    /// What the style sets.
    pub fn values(self) -> StyleValues {
        let usual =
            StyleValues { background: None, light: Light::UpperLeft, front: None, occlusion: None };
        match self {
            Style::Default => usual,
            Style::Paper => StyleValues {
                background: Some(Background::White),
                front: Some(linear(0x00bf_b3a4)),
                occlusion: Some(true),
                ..usual
            },
            Style::Studio => StyleValues {
                background: Some(Background::Dark),
                front: Some(linear(0x00e3_b27c)),
                occlusion: Some(true),
                ..usual
            },
            Style::Flat => StyleValues {
                background: Some(Background::White),
                light: Light::Eye,
                occlusion: Some(false),
                ..usual
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_style_sets_nothing_and_the_others_differ_from_it_and_from_each_other() {
        let [default, others @ ..] = Style::ALL.map(Style::values);
        assert_eq!((default.background, default.front, default.occlusion), (None, None, None));
        assert_eq!(default.light, Light::default());
        for (i, style) in others.iter().enumerate() {
            // A style fixes what would else depend on the reader's machine.
            assert!(style.background.is_some() && style.occlusion.is_some(), "{style:?}");
            assert!(!others[..i].contains(style), "{style:?} twice");
        }
    }

    #[test]
    fn names_are_those_of_the_flag() {
        for style in Style::ALL {
            assert_eq!(style.name().parse::<Style>().ok(), Some(style));
        }
        let error = "gallery".parse::<Style>().expect_err("no style").to_string();
        assert!(error.contains("default, paper, studio, flat"), "{error}");
    }
}
