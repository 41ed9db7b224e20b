//! The volume made generic by an invisible ramp, with exact predicates on it.
//!
//! # Theory
//!
//! Morse theory of the trilinear field needs distinct samples, and its saddles are roots of
//! polynomials of degree up to six, so an order of the samples alone does not resolve ties. The
//! field is therefore made generic by an explicit affine ramp (an affine function adds no
//! critical point inside a plateau), and all predicates use one integer field
//!
//! V = level * M + ramp,  ramp(i, j, k) = -(1 + i' + 37 j' + 1009 k'),  i' = i + 1, ...
//!
//! where *level* is the sample as an integer (the sample itself for integer types; for floating
//! point the number of whole steps above the minimum rounded down to a step, a step being the power of two from range / 2^44 on) and M a power of two, at
//! least 2^52 and at least 10^6 times the ramp. V is called the *key*.
//!
//! The ramp is negative, so a sample equal to the isovalue lies below it, and
//! [`ExactField::isovalue_key`] never falls among the keys of one level: a sample is inside
//! exactly if its level exceeds the isovalue's, with no trace of the ramp.
//!
//! A block of a volume (`Volume::block_position`) has the keys of the whole: the ramp is that of the whole.
//!
//! Critical points and their types: `face` (saddles on cell faces) and `body` (saddles inside
//! cells); a vertex needs comparisons of keys alone.
//!
//! # Invariants
//!
//! - Only exact integers decide: floating point answers where an error bound proves its sign.
//! - A predicate against an isovalue that is exactly zero counts as "not above", so everything
//!   behaves as at an isovalue an infinitesimal higher, the same from every cell.
//! - A zero of a predicate without an isovalue (a ramp too weak for a special configuration) is
//!   resolved conservatively: the face saddle is regular, the body saddle outside its cell.
//! - The layer around the volume has one level, ten ranges outside, plus the ramp. The only
//!   critical points it adds are within the ramp of that level, far outside the volume's range
//!   (they depend on the samples at edges and corners of the volume); elsewhere all differences
//!   towards the layer have one sign.

mod body;
mod estimate;
mod face;
mod field;
mod isovalue;

pub(crate) use body::can_hold_body_saddle;
pub use body::{BodySaddle, Trilinear};
pub use face::FaceSaddle;
pub(crate) use face::is_saddle_above;
pub(crate) use field::BRICK;
pub(super) use field::power_of_two_from;
pub use field::{ExactField, ORDER_BITS};
pub use isovalue::IsovalueKeys;

#[cfg(test)]
mod tests;
