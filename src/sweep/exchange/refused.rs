//! Why an exchange is refused.

/// Why an exchange was refused, and the samples around which cells must become exact; none if the exchange needs more of
/// the mesh.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::sweep) struct Refused {
    pub(in crate::sweep) why: &'static str,
    pub(in crate::sweep) samples: Vec<u32>,
}

impl Refused {
    pub(super) fn at(why: &'static str, samples: impl IntoIterator<Item = u32>) -> Refused {
        Refused { why, samples: samples.into_iter().collect() }
    }
}

/// Reasons to refuse an exchange.
#[derive(Default)]
pub(super) struct Refusals {
    why: Option<&'static str>,
    samples: Vec<u32>,
}

impl Refusals {
    pub(super) fn add(&mut self, why: &'static str, samples: impl IntoIterator<Item = u32>) {
        let before = self.samples.len();
        self.samples.extend(samples);
        if self.samples.len() > before {
            self.why.get_or_insert(why);
        }
    }

    pub(super) fn none(self) -> Result<(), Refused> {
        self.why.map_or(Ok(()), |why| Err(Refused { why, samples: self.samples }))
    }
}
