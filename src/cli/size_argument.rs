//! `--size 1024x768`: the width and the height of a picture or a window.

use std::str::FromStr;

/// Longest side of a picture, pixels: the limit of textures on GPUs.
const MAX_SIDE: u32 = 16384;

/// A width and a height, each from 1 to [`MAX_SIDE`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PictureSize {
    pub(super) width: u32,
    pub(super) height: u32,
}

impl FromStr for PictureSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let side = |digits: &str| digits.parse().ok().filter(|n| (1..=MAX_SIDE).contains(n));
        let sides = text.split_once(['x', 'X']);
        sides
            .and_then(|(w, h)| Some(PictureSize { width: side(w)?, height: side(h)? }))
            .ok_or_else(|| format!("'{text}', expected e.g. 1024x768, each from 1 to {MAX_SIDE}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_has_a_width_and_a_height() {
        assert_eq!("640x480".parse(), Ok(PictureSize { width: 640, height: 480 }));
        for wrong in ["", "640", "0x480", "640x480x3", "-1x2", "99999x1"] {
            assert!(wrong.parse::<PictureSize>().is_err(), "{wrong}");
        }
    }
}
