//! Two-line element sets as text: found in a file, and checked column by column as far as the format itself
//! can tell: 69 characters, line numbers, equal catalogue numbers, checksums modulo 10.

use super::schema::nearest;

/// One set: a name line if there was one, and the two lines.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Set {
    pub name: Option<String>,
    pub lines: [String; 2],
}

impl Set {
    /// Everything wrong with the two lines.
    pub fn faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        for (line, number) in self.lines.iter().zip(1u32..) {
            let length = line.chars().count();
            if !line.is_ascii() || length != 69 {
                faults.push(format!(
                    "line {number} of the element set has {length} characters; it must have 69, all ASCII"
                ));
            } else if !line.starts_with(&format!("{number} ")) {
                faults.push(format!("line {number} of the element set must begin with \"{number} \""));
            } else {
                let found = &line[68..];
                let expected = checksum(line);
                if found != expected.to_string() {
                    faults.push(format!(
                        "line {number} of the element set: checksum is {found}, expected {expected}"
                    ));
                }
            }
        }
        let catalogue = |line: &String| line.get(2..7).map(str::to_string);
        if faults.is_empty() && catalogue(&self.lines[0]) != catalogue(&self.lines[1]) {
            faults.push("lines 1 and 2 of the element set have different catalogue numbers".into());
        }
        faults
    }
}

/// Sum of the digits of the first 68 columns, a minus sign counting 1, modulo 10.
fn checksum(line: &str) -> u32 {
    let worth = |c: char| if c == '-' { 1 } else { c.to_digit(10).unwrap_or(0) };
    line.chars().take(68).map(worth).sum::<u32>() % 10
}

/// The one set that two or three lines make.
pub(super) fn from_lines(lines: &[&str]) -> Result<Set, String> {
    let clean = |line: &str| line.trim_end().to_string();
    match lines {
        [one, two] => Ok(Set { name: None, lines: [clean(one), clean(two)] }),
        [name, one, two] => Ok(Set { name: Some(title(name)), lines: [clean(one), clean(two)] }),
        _ => Err(format!("an element set has 2 lines, or 3 with its name; here are {}", lines.len())),
    }
}

/// A name line without its optional leading `0 `.
fn title(line: &str) -> String {
    let line = line.trim();
    line.strip_prefix("0 ").unwrap_or(line).trim().to_string()
}

/// The set for `target` in a file: the only one, or the one of that name.
pub(super) fn from_file(text: &str, target: &str) -> Result<Set, String> {
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
    let mut sets: Vec<Set> = Vec::new();
    for (i, pair) in lines.windows(2).enumerate() {
        if pair[0].starts_with("1 ") && pair[1].starts_with("2 ") {
            let before = i.checked_sub(1).and_then(|at| lines.get(at));
            let name =
                before.filter(|line| !line.starts_with("2 ") && !line.starts_with('#')).map(|line| title(line));
            sets.push(Set { name, lines: [pair[0].trim_end().into(), pair[1].trim_end().into()] });
        }
    }
    let count = sets.len();
    if count == 1 {
        return sets.pop().ok_or_else(String::new);
    }
    if let Some(set) = sets.iter().find(|set| set.name.as_deref() == Some(target.trim())) {
        return Ok(set.clone());
    }
    let near = nearest(target, sets.iter().filter_map(|set| set.name.as_deref()));
    let near = near.map_or(String::new(), |name| format!("; nearest: \"{name}\""));
    match count {
        0 => Err("the file holds no two-line element set".into()),
        _ => Err(format!("none of the {count} element sets in the file is named \"{target}\"{near}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: &str = "1 35491U 09033A   18019.95817924 -.00000090  00000-0  00000-0 0  9991";
    const TWO: &str = "2 35491   0.0698 263.4367 0009544 339.3413 117.1094  1.00271818 31371";

    #[test]
    fn a_good_set_has_no_faults_and_a_changed_digit_is_found() {
        assert_eq!(from_lines(&[ONE, TWO]).unwrap().faults(), Vec::<String>::new());
        let wrong = TWO.replace("263.4367", "263.4368");
        let faults = from_lines(&[ONE, &wrong]).unwrap().faults();
        assert_eq!(faults, ["line 2 of the element set: checksum is 1, expected 2"]);
        assert_eq!(from_lines(&[&ONE[..60], "é"]).unwrap().faults().len(), 2);
    }

    #[test]
    fn a_file_of_many_is_searched_by_name() {
        let file = format!("OTHER\r\n{ONE}\r\n{TWO}\r\n0 GOES 14\n{ONE}\n{TWO}\n");
        assert_eq!(from_file(&file, "GOES 14").unwrap().name.as_deref(), Some("GOES 14"));
        assert!(from_file(&file, "GOES 15").unwrap_err().contains("nearest: \"GOES 14\""));
        assert_eq!(from_file(&format!("{ONE}\n{TWO}\n"), "any").unwrap().name, None);
        assert!(from_file("", "any").is_err());
    }
}
