//! Names of enum values on the command line (colours, maps, backgrounds, lights, axes). All such types list their values, and
//! report an unknown name, in the same way.

/// Implements `ALL`, `name` and `FromStr` for an enum, from its values and their names; `$kind` names the type in the error
/// message.
macro_rules! named_values {
    ($type:ident, $kind:literal: $($value:ident = $name:literal),+ $(,)?) => {
        impl $type {
            /// Every value, in the order of the documentation.
            pub const ALL: [$type; [$($name),+].len()] = [$($type::$value),+];

            /// The name, as in command-line flags.
            pub fn name(self) -> &'static str {
                match self {
                    $($type::$value => $name,)+
                }
            }
        }

        impl std::str::FromStr for $type {
            type Err = crate::error::Error;

            /// Parses the name used by command-line flags.
            ///
            /// # Errors
            ///
            /// [`Error::Usage`](crate::Error::Usage) for any other text.
            fn from_str(text: &str) -> crate::error::Result<Self> {
                let found = <$type>::ALL.into_iter().find(|value| value.name() == text);
                found.ok_or_else(|| {
                    let names = <$type>::ALL.map(<$type>::name).join(", ");
                    crate::error::Error::Usage(format!(
                        "{} '{text}', expected one of {names}",
                        $kind
                    ))
                })
            }
        }
    };
}

pub(crate) use named_values;
