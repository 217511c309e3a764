//! `data:` URIs (RFC 2397).

use super::budget::{Budget, OverBudget};
use base64::Engine;
use base64::alphabet;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use std::borrow::Cow;

/// Padding may be missing, as some exporters leave it out.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &alphabet::STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// What is wrong with a data URI.
#[derive(Debug, PartialEq, thiserror::Error)]
pub(crate) enum DataUriFault {
    #[error("the data URI has no comma")]
    NoComma,
    #[error("the data URI is not valid base64: {0}")]
    Base64(#[from] base64::DecodeError),
    #[error(transparent)]
    OverBudget(#[from] OverBudget),
}

/// The media type and the bytes; `None` if it is not a data URI.
pub(crate) fn decode<'a>(uri: &'a str, budget: &Budget) -> Option<Result<(&'a str, Vec<u8>), DataUriFault>> {
    let scheme = uri.get(..5)?;
    scheme.eq_ignore_ascii_case("data:").then(|| decode_body(&uri[5..], budget))
}

fn decode_body<'a>(body: &'a str, budget: &Budget) -> Result<(&'a str, Vec<u8>), DataUriFault> {
    let (head, data) = body.split_once(',').ok_or(DataUriFault::NoComma)?;
    let is_base64 = head.len() >= 7 && head.as_bytes()[head.len() - 7..].eq_ignore_ascii_case(b";base64");
    let media_type = if is_base64 { &head[..head.len() - 7] } else { head };
    if !is_base64 {
        budget.charge(data.len() as u64)?;
        return Ok((media_type, percent_encoding::percent_decode_str(data).collect()));
    }
    let decoded_size = base64::decoded_len_estimate(data.len()) as u64;
    let plain: Cow<'_, [u8]> = if data.contains('%') {
        budget.charge(data.len() as u64)?;
        percent_encoding::percent_decode_str(data).into()
    } else {
        Cow::Borrowed(data.as_bytes())
    };
    budget.charge(decoded_size)?;
    let bytes = BASE64.decode(&plain)?;
    if matches!(plain, Cow::Owned(_)) {
        budget.release(data.len() as u64);
    }
    Ok((media_type, bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ok(uri: &str) -> (&str, Vec<u8>) {
        decode(uri, &Budget::new(1000)).unwrap().unwrap()
    }

    #[test]
    fn base64_and_percent_encoding_are_decoded() {
        assert_eq!(ok("data:application/octet-stream;base64,AAEC"), ("application/octet-stream", vec![0, 1, 2]));
        assert_eq!(ok("DATA:image/png;BASE64,AA=="), ("image/png", vec![0]));
        assert_eq!(ok("data:;base64,AA"), ("", vec![0]));
        assert_eq!(ok("data:;base64,%41A%3d%3D"), ("", vec![0]));
        assert_eq!(ok("data:text/plain,a%20%FFb"), ("text/plain", b"a \xffb".to_vec()));
        assert_eq!(ok("data:,"), ("", vec![]));
    }

    #[test]
    fn damaged_or_too_large_ones_are_errors() {
        let small = Budget::new(2);
        assert_eq!(decode("data:;base64", &small).unwrap(), Err(DataUriFault::NoComma));
        assert!(matches!(decode("data:;base64,A*", &Budget::new(9)).unwrap(), Err(DataUriFault::Base64(_))));
        assert!(matches!(decode("data:;base64,AAAA", &small).unwrap(), Err(DataUriFault::OverBudget(_))));
        assert!(matches!(decode("data:,aaaa", &small).unwrap(), Err(DataUriFault::OverBudget(_))));
    }

    #[test]
    fn other_uris_are_not_data() {
        assert!(decode("data.bin", &Budget::new(0)).is_none());
        assert!(decode("dat", &Budget::new(0)).is_none());
    }
}
