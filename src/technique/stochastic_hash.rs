//! One photon for each cell of a hash table, chosen at random for all that fall there (Hachisuka & Jensen
//! 2010, who keep the last that came; chosen evenly as Davidovič et al. 2014 have it, without bias).

use super::lists::Lists;
use crate::Result;
use crate::render::Engine;

/// Of the table (Kern et al. 2023, section 4.1: 2^16 to 2^18).
const BUCKETS: usize = 1 << 18;

/// Cells of edge r; those that share a bucket share its photon.
pub fn new(engine: &Engine) -> Result<Lists> {
    Lists::new(engine, 1, |_| BUCKETS)
}
