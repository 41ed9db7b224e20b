//! `FromStr` for types whose values have names on the command line (colours, maps, backgrounds, lights, axes), so that all of
//! them report an unknown name in the same way.

/// Implements `FromStr` for a type with an array `ALL` of its values and a method `name`; `$kind` names the type in the error
/// message.
macro_rules! from_name {
    ($named:ty, $kind:literal) => {
        impl std::str::FromStr for $named {
            type Err = crate::error::Error;

            /// Parses the name used by command-line flags.
            ///
            /// # Errors
            ///
            /// [`Error::Usage`](crate::Error::Usage) for any other text.
            fn from_str(text: &str) -> crate::error::Result<Self> {
                let found = <$named>::ALL.into_iter().find(|one| one.name() == text);
                found.ok_or_else(|| {
                    let names = <$named>::ALL.map(<$named>::name).join(", ");
                    crate::error::Error::Usage(format!(
                        "{} '{text}', expected one of {names}",
                        $kind
                    ))
                })
            }
        }
    };
}

pub(crate) use from_name;
