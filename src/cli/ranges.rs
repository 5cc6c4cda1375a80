//! Lists of numbers as the command line writes them: `0-3,5`.

/// The numbers of a list, in the order given and each once. Errors name the part that is no number or range.
pub fn parse(list: &str) -> Result<Vec<usize>, String> {
    /// Far above the number of surfaces of any model, and small enough that a typing slip costs no memory.
    const LARGEST: usize = 1_000_000;
    let number = |text: &str| {
        let value = text.trim().parse::<usize>().map_err(|_| format!("`{text}` in `{list}` is no number"))?;
        if value > LARGEST { Err(format!("{value} in `{list}` is above {LARGEST}")) } else { Ok(value) }
    };
    let mut numbers = Vec::new();
    for part in list.split(',') {
        let (low, high) = match part.split_once('-') {
            Some((low, high)) => (number(low)?, number(high)?),
            None => (number(part)?, number(part)?),
        };
        if low > high {
            return Err(format!("`{part}` in `{list}` runs backwards"));
        }
        numbers.extend(low..=high);
    }
    let mut seen = std::collections::HashSet::new();
    numbers.retain(|n| seen.insert(*n));
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_read_as_the_manual_says() {
        assert_eq!(parse("0-3,5").unwrap(), [0, 1, 2, 3, 5]);
        assert_eq!(parse("7, 2-2,7").unwrap(), [7, 2]);
        for bad in ["", "a", "3-1", "1-", "-1", "1,,2", "0-99999999999"] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }
}
