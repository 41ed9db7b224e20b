//! Setters for structs that callers cannot build with a literal because they are `#[non_exhaustive]`.

/// Implements a chainable setter for each field. Setters of `optional` fields take a value or an `Option`.
macro_rules! setters {
    ($($set:ident($field:ident: $type:ty)),* $(,)?; optional: $($set_optional:ident($optional:ident: $inner:ty)),* $(,)?) => {
        $(
            #[doc = concat!("Sets [`", stringify!($field), "`](Self::", stringify!($field), ").")]
            #[must_use]
            pub fn $set(mut self, $field: $type) -> Self {
                self.$field = $field;
                self
            }
        )*
        $(
            #[doc = concat!("Sets [`", stringify!($optional), "`](Self::", stringify!($optional), ").")]
            #[must_use]
            pub fn $set_optional(mut self, $optional: impl Into<Option<$inner>>) -> Self {
                self.$optional = $optional.into();
                self
            }
        )*
    };
}

pub(crate) use setters;
