//! What flags spell by name: colours, maps, backgrounds, lights, axes. One reading for all, so that what is wrong is told alike.

/// Lets a type with `ALL` and `name` be read from its names; `what` it is stands in the message.
macro_rules! read_by_name {
    ($named:ty, $what:literal) => {
        impl std::str::FromStr for $named {
            type Err = crate::error::Error;

            /// Reads the name as flags spell it.
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
                        $what
                    ))
                })
            }
        }
    };
}

pub(crate) use read_by_name;
