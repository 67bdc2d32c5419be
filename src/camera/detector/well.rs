//! Full well: a pixel holds so many electrons; the excess is lost, or runs along its column.
//!
//! Blooming: half of a pixel's excess goes up its column and half down, each filling pixels to the brim until it finds room
//! or leaves the chip at the end (Janesick 2001, Scientific CCDs, sect. 4.3: channel stops keep it in the column).

/// Clip charge \[e-\] at `full_well_e`.
pub fn clip(row: &mut [f64], full_well_e: f64) {
    for value in row {
        *value = value.min(full_well_e);
    }
}

/// Let the excess of a whole column run along it; the charge that leaves at the ends \[e-\].
pub fn bloom(column: &mut [u32], full_well: u32) -> u64 {
    let excess = |charge: u32| charge.saturating_sub(full_well);
    // the larger half of an odd electron goes down
    let ups = column.iter().map(|q| excess(*q) / 2).collect::<Vec<_>>();
    let downs = column.iter().zip(&ups).map(|(q, up)| excess(*q) - up).collect::<Vec<_>>();
    column.iter_mut().for_each(|q| *q = (*q).min(full_well));
    let mut carried = 0u64;
    let mut pass = |charge: &mut u32, own: u32| {
        let taken = carried.min(u64::from(full_well - *charge));
        *charge += taken as u32;
        carried += u64::from(own) - taken;
    };
    for (charge, own) in column.iter_mut().zip(&ups) {
        pass(charge, *own);
    }
    let mut lost = std::mem::take(&mut carried);
    let mut pass = |charge: &mut u32, own: u32| {
        let taken = carried.min(u64::from(full_well - *charge));
        *charge += taken as u32;
        carried += u64::from(own) - taken;
    };
    for (charge, own) in column.iter_mut().zip(&downs).rev() {
        pass(charge, *own);
    }
    lost += carried;
    lost
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn excess_runs_both_ways() {
        let mut column = [0, 0, 10, 190, 10, 0, 0];
        assert_eq!(bloom(&mut column, 50), 0);
        assert_eq!(column, [0, 30, 50, 50, 50, 30, 0]);
        let mut column = [500, 0];
        // 225 go up: 50 find room; 225 go down and leave
        assert_eq!((bloom(&mut column, 50), column), (400, [50, 50]));
        let mut none = [5, 0, 7];
        assert_eq!((bloom(&mut none, 0), none), (12, [0, 0, 0]));
    }

    proptest! {
        /// What is in the column and what has left it is what was there; no pixel holds more than its well.
        #[test]
        fn charge_is_conserved(mut column in prop::collection::vec(0u32..300_000, 1..200), well in 0u32..100_000) {
            let before = column.iter().map(|q| u64::from(*q)).sum::<u64>();
            let lost = bloom(&mut column, well);
            prop_assert_eq!(column.iter().map(|q| u64::from(*q)).sum::<u64>() + lost, before);
            prop_assert!(column.iter().all(|q| *q <= well));
        }
    }
}
