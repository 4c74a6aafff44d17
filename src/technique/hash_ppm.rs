//! Photons in a hash table of lists of fixed length: the rival of Kern et al. 2023 after Mara et al. 2013.

use super::lists::Lists;
use crate::Result;
use crate::render::Engine;

/// Photons that a list keeps.
const LENGTH: u32 = 12;
/// Buckets at least; more where photons could fill them, as probing needs free ones.
const BUCKETS: usize = 1 << 20;

/// Cells of edge r, one to a bucket.
pub fn new(engine: &Engine) -> Result<Lists> {
    Lists::new(engine, LENGTH, |photons| {
        BUCKETS.max((2 * photons).next_power_of_two())
    })
}
