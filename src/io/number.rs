//! Numbers as IGES and STEP write them.

/// A number with a decimal point and as few digits as give the same double back.
pub fn real(value: f64) -> String {
    let text = format!("{value:?}");
    match text.split_once('e') {
        Some((mantissa, exponent)) if mantissa.contains('.') => format!("{mantissa}E{exponent}"),
        Some((mantissa, exponent)) => format!("{mantissa}.E{exponent}"),
        None => text.strip_suffix('0').filter(|t| t.ends_with('.')).map_or(text.clone(), str::to_owned),
    }
}
