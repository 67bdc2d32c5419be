//! Files with the elements of many objects: two-line sets with or without names, or orbit mean-elements messages.

use super::elements::MeanElements;
use super::omm;
use super::tle::Tle;
use crate::astro::Error;

/// The objects of a file, and what is wrong with those that cannot be used.
#[derive(Debug, Default)]
pub struct Listed {
    /// Elements, in the file's order.
    pub objects: Vec<MeanElements>,
    /// Faults, each naming its object.
    pub faults: Vec<Error>,
}

impl Listed {
    /// The objects of a text. Those that cannot be used are left out and told.
    ///
    /// # Errors
    /// [`Error::Elements`] where the text holds no object that can be used.
    pub fn read(text: &str) -> Result<Self, Error> {
        let read = if omm::looks_like(text) {
            omm::each(text)?
        } else {
            Tle::all(text).iter().map(Tle::elements).collect()
        };
        let mut listed = Self::default();
        for object in read {
            match object {
                Ok(elements) => listed.objects.push(elements),
                Err(fault) => listed.faults.push(fault),
            }
        }
        if listed.objects.is_empty() {
            let reason = match listed.faults.first() {
                Some(first) => {
                    format!("none of its {} element sets can be used; the first: {first}", listed.faults.len())
                }
                None => "it holds neither two-line sets nor orbit mean-elements messages".into(),
            };
            return Err(Error::Elements { name: "the catalogue".into(), reason });
        }
        Ok(listed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn good_objects_are_kept_and_bad_ones_told() {
        let good = "GOES 14\n1 35491U 09033A   18019.95817924 -.00000090  00000-0  00000-0 0  9991\n\
                    2 35491   0.0698 263.4367 0009544 339.3413 117.1094  1.00271818 31371\n";
        let listed = Listed::read(&format!("{good}{}", good.replace("263.4367", "263.4368"))).expect("one object");
        assert_eq!((listed.objects.len(), listed.faults.len()), (1, 1));
        assert!(listed.faults[0].to_string().contains("checksum is 1, expected 2"));
        assert!(Listed::read("nothing").expect_err("none").to_string().contains("neither"));
        assert!(Listed::read(&good.replace("263", "264")).expect_err("bad").to_string().contains("none of its 1"));
    }
}
