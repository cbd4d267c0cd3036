//! Axes: where a value lies, which marks an axis has, how a number is written.

use crate::words::noun;

/// A share in percent with one decimal; only what is nothing or all is written as that.
pub(in crate::report) fn percent(share: f64) -> String {
    let tenths = (1000.0 * share).round();
    let tenths = if share > 0.0 && share < 1.0 { tenths.clamp(1.0, 999.0) } else { tenths };
    format!("{:.1}", tenths / 10.0)
}

/// Percent of the width at which a value of an axis from `low` to `high` lies.
pub(super) fn place(value: f64, low: f64, high: f64) -> String {
    format!("{:.2}", 100.0 * (value - low) / (high - low))
}

/// A coordinate of a panel.
pub(super) fn coordinate(value: f64) -> String {
    format!("{value:.1}")
}

/// A whole number with a thin space between thousands.
pub(in crate::report) fn thousands(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// So many of something.
pub(in crate::report) fn many(count: u64, thing: &str) -> String {
    format!("{} {}", thousands(count), noun(count, thing))
}

/// A difference in percentage points, with a true minus sign.
pub(in crate::report) fn points(difference: f64) -> String {
    let sign = if difference < 0.0 { '\u{2212}' } else { '+' };
    format!("{sign}{:.1}", 100.0 * difference.abs())
}

/// A number without trailing zeros.
pub(in crate::report) fn short(number: f64) -> String {
    let text = format!("{number:.2}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// The step 1, 2 or 5 times a power of ten that divides `span` into about `n_steps`.
pub(super) fn nice_step(span: f64, n_steps: f64) -> f64 {
    let raw = span / n_steps;
    let power = 10_f64.powf(raw.log10().floor());
    let factor = [1.0, 2.0, 5.0].into_iter().find(|factor| factor * power >= raw * 0.999).unwrap_or(10.0);
    factor * power
}

/// A power of ten as people write it.
pub(super) fn power_of_ten(exponent: i32) -> String {
    match exponent {
        -3..=3 => short_power(exponent),
        _ => format!("10{}", exponent.to_string().chars().map(superscript).collect::<String>()),
    }
}

fn short_power(exponent: i32) -> String {
    let decimals = usize::try_from(-exponent).unwrap_or(0);
    format!("{:.decimals$}", 10_f64.powi(exponent))
}

fn superscript(character: char) -> char {
    match character {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '0' | '4'..='9' => char::from_u32(0x2070 + character as u32 - '0' as u32).unwrap_or(character),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::{nice_step, percent, power_of_ten, short, thousands};

    #[test]
    fn only_all_is_written_as_a_hundred_percent() {
        assert_eq!([0.0, 0.00001, 0.98249, 0.99999, 1.0].map(percent), ["0.0", "0.1", "98.2", "99.9", "100.0"]);
    }

    #[test]
    fn steps_are_one_two_or_five() {
        assert_eq!([7.0, 23.0, 1500.0, 0.4].map(|span| nice_step(span, 5.0)), [2.0, 5.0, 500.0, 0.1]);
    }

    #[test]
    fn numbers_are_written_for_reading() {
        assert_eq!([3, 1200, 1_234_567].map(thousands), ["3", "1\u{202f}200", "1\u{202f}234\u{202f}567"]);
        assert_eq!([-5, -2, 0, 2, 4].map(power_of_ten), ["10⁻⁵", "0.01", "1", "100", "10⁴"]);
        assert_eq!([0.4, 25.0, 100.0, 0.0].map(short), ["0.4", "25", "100", "0"]);
    }
}
