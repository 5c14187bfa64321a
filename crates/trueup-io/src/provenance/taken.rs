//! When photographs were taken.

use exif::{Field, Tag};

use super::fields::text;

/// A moment as EXIF has it: local time, and what is known beyond it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Moment {
    /// `YYYY:MM:DD HH:MM:SS`.
    pub(super) local: String,
    /// Digits behind the seconds' decimal point.
    pub(super) subseconds: Option<String>,
    /// `+HH:MM` or `-HH:MM`: local time less universal time.
    pub(super) offset: Option<String>,
}

impl Moment {
    /// DateTimeOriginal and what belongs to it. Dates that cannot be, such as the blanks and zeros of a camera whose
    /// clock was never set, are none.
    pub(super) fn of(fields: &[Field]) -> Option<Self> {
        let local = text(fields, Tag::DateTimeOriginal)?;
        let moment = Self {
            local,
            subseconds: text(fields, Tag::SubSecTimeOriginal)
                .filter(|digits| digits.bytes().all(|byte| byte.is_ascii_digit())),
            offset: text(fields, Tag::OffsetTimeOriginal).filter(|offset| offset_minutes(offset).is_some()),
        };
        moment.parts().is_some().then_some(moment)
    }

    /// Year, month, day, hour, minute, second.
    fn parts(&self) -> Option<[i64; 6]> {
        let (date, time) = self.local.split_once(' ')?;
        let numbers: Vec<i64> =
            date.split(':').chain(time.split(':')).map(|part| part.parse().ok()).collect::<Option<_>>()?;
        let parts: [i64; 6] = numbers.try_into().ok()?;
        let [year, month, day, hour, minute, second] = parts;
        let is_one = (1..=9999).contains(&year)
            && (1..=12).contains(&month)
            && (1..=31).contains(&day)
            && (0..24).contains(&hour)
            && (0..60).contains(&minute)
            && (0..=60).contains(&second);
        is_one.then_some(parts)
    }

    /// Order in time: minutes of an even calendar and seconds with their fraction; universal time if asked for.
    fn order(&self, universal: bool) -> (i64, f64) {
        let Some([year, month, day, hour, minute, second]) = self.parts() else { return (0, 0.0) };
        let offset = self.offset.as_deref().and_then(offset_minutes).filter(|_| universal).unwrap_or(0);
        // Months of 31 days keep the order of dates; an offset moves hours only.
        let minutes = (((year * 12 + month) * 31 + day) * 24 + hour) * 60 + minute - offset;
        let fraction = self.subseconds.as_ref().and_then(|digits| format!("0.{digits}").parse::<f64>().ok());
        (minutes, second as f64 + fraction.unwrap_or(0.0))
    }

    /// Seconds since 1970 in local time, with their fraction.
    ///
    /// # Source
    /// Days of the proleptic Gregorian calendar: Fliegel and Van Flandern, A Machine Algorithm for Processing Calendar
    /// Dates, Communications of the ACM 11 (10), 1968; 2440588 is the Julian day of 1970-01-01.
    pub(super) fn seconds(&self) -> Option<f64> {
        const JULIAN_1970: i64 = 2_440_588;
        let [year, month, day, hour, minute, second] = self.parts()?;
        // -1 in January and February, which count to the year before; divisions truncate towards zero.
        let early = (month - 14) / 12;
        let julian = day - 32_075 + 1461 * (year + 4800 + early) / 4 + 367 * (month - 2 - early * 12) / 12
            - 3 * ((year + 4900 + early) / 100) / 4;
        let whole = (((julian - JULIAN_1970) * 24 + hour) * 60 + minute) * 60 + second;
        let fraction = self.subseconds.as_ref().and_then(|digits| format!("0.{digits}").parse::<f64>().ok());
        Some(whole as f64 + fraction.unwrap_or(0.0))
    }

    /// As ISO 8601 has it, for XMP.
    pub(super) fn iso(&self) -> Option<String> {
        let [year, month, day, hour, minute, second] = self.parts()?;
        let fraction = self.subseconds.as_ref().map(|digits| format!(".{digits}")).unwrap_or_default();
        let offset = self.offset.as_deref().unwrap_or_default();
        Some(format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}{fraction}{offset}"))
    }
}

/// The earliest and the latest. Offsets from universal time count only if all moments have one.
pub(super) fn span<'a>(moments: impl Iterator<Item = &'a Moment>) -> (Option<Moment>, Option<Moment>) {
    let moments: Vec<&Moment> = moments.collect();
    let universal = moments.iter().all(|moment| moment.offset.is_some());
    let by_order = |a: &&&Moment, b: &&&Moment| {
        let (a, b) = (a.order(universal), b.order(universal));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
    };
    let earliest = moments.iter().min_by(by_order).map(|moment| (*moment).clone());
    let latest = moments.iter().max_by(by_order).map(|moment| (*moment).clone());
    (earliest, latest)
}

fn offset_minutes(offset: &str) -> Option<i64> {
    let (sign, rest) = match offset.split_at_checked(1)? {
        ("+", rest) => (1, rest),
        ("-", rest) => (-1, rest),
        _ => return None,
    };
    let (hours, minutes) = rest.split_once(':')?;
    let (hours, minutes) = (hours.parse::<i64>().ok()?, minutes.parse::<i64>().ok()?);
    ((0..=14).contains(&hours) && (0..60).contains(&minutes)).then_some(sign * (hours * 60 + minutes))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moment(local: &str, subseconds: Option<&str>, offset: Option<&str>) -> Moment {
        Moment { local: local.to_owned(), subseconds: subseconds.map(Into::into), offset: offset.map(Into::into) }
    }

    #[test]
    fn the_span_heeds_offsets_and_fractions() {
        // 23:30 in Tokyo is 14:30 universal time, before 16:00 in Berlin (15:00).
        let tokyo = moment("2024:05:04 23:30:00", None, Some("+09:00"));
        let berlin = moment("2024:05:04 16:00:00", None, Some("+01:00"));
        let (first, last) = span([&berlin, &tokyo].into_iter());
        assert_eq!((first, last), (Some(tokyo.clone()), Some(berlin.clone())));
        let nowhere = moment("2024:05:04 17:00:00", None, None);
        assert_eq!(span([&tokyo, &berlin, &nowhere].into_iter()), (Some(berlin), Some(tokyo)));
        let (early, late) =
            (moment("2024:05:04 01:00:00", Some("05"), None), moment("2024:05:04 01:00:00", Some("4"), None));
        assert_eq!(span([&late, &early].into_iter()).0, Some(early.clone()));
        assert_eq!(early.iso().as_deref(), Some("2024-05-04T01:00:00.05"));
        assert_eq!(span(std::iter::empty()), (None, None));
    }

    /// By `date -u +%s`.
    #[test]
    fn seconds_are_counted_across_months_and_leap_days() {
        let seconds = |local: &str| moment(local, None, None).seconds();
        assert_eq!(seconds("1970:01:01 00:00:00"), Some(0.0));
        assert_eq!(seconds("2024:05:04 10:00:01"), Some(1_714_816_801.0));
        assert_eq!(seconds("2023:12:31 23:59:59"), Some(1_704_067_199.0));
        assert_eq!(seconds("2024:03:01 00:00:00"), Some(1_709_251_200.0));
        assert_eq!(moment("1970:01:01 00:00:02", Some("25"), None).seconds(), Some(2.25));
    }

    #[test]
    fn clocks_never_set_tell_nothing() {
        for local in ["0000:00:00 00:00:00", "    :  :     :  :  ", "", "2024-05-04", "2024:13:01 00:00:00"] {
            assert_eq!(moment(local, None, None).parts(), None, "{local}");
        }
        assert_eq!((offset_minutes("-03:30"), offset_minutes("Z"), offset_minutes("+99:00")), (Some(-210), None, None));
    }
}
