//! What is wrong with a JSON text, in words for whoever wrote the text: the parser speaks of its own types.

/// A message of the parser, without the position in the text, in plain words. What is not known stays as it is.
pub(crate) fn plain(message: &str) -> String {
    let message = message.rfind(" at line ").map_or(message, |end| &message[..end]);
    known(message).unwrap_or_else(|| message.to_owned())
}

fn known(message: &str) -> Option<String> {
    if let Some(name) = message.strip_prefix("missing field ") {
        return Some(format!("the member {} is missing", quoted(name)));
    }
    if let Some(name) = message.strip_prefix("duplicate field ") {
        return Some(format!("the member {} comes twice", quoted(name)));
    }
    for (prefix, is_not) in [("unknown field ", "there is no member "), ("unknown variant ", "it cannot be ")] {
        if let Some(rest) = message.strip_prefix(prefix) {
            let (name, known) = rest.split_once(", ")?;
            let known = known.strip_prefix("expected ").unwrap_or("none");
            let known = known.strip_prefix("one of ").unwrap_or(known).replace(" or ", ", ");
            return Some(format!("{is_not}{}; known are: {}", quoted(name), known.replace('`', "")));
        }
    }
    if let Some(rest) = message.strip_prefix("invalid length ") {
        let (length, expected) = rest.split_once(", expected ")?;
        return Some(format!("it has {length} elements, and has to be {}", wanted(expected)));
    }
    let rest = message.strip_prefix("invalid type: ").or_else(|| message.strip_prefix("invalid value: "))?;
    // What was found may hold the words itself.
    let (found, expected) = rest.rsplit_once(", expected ")?;
    Some(format!("it has to be {}, and is {}", wanted(expected), given(found)))
}

/// A name in backquotes, in quotes.
fn quoted(name: &str) -> String {
    format!("{:?}", name.trim_matches('`'))
}

/// A type, as the text would have it.
fn wanted(expected: &str) -> String {
    let words = match expected {
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number, 0 or more",
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number",
        "f32" | "f64" => "a number",
        "a boolean" => "true or false",
        "a sequence" => "a list",
        "a map" => "an object",
        "variant identifier" => "a string",
        _ if expected.starts_with("struct ") || expected.starts_with("internally tagged enum ") => "an object",
        _ if expected.starts_with("enum ") => "a string",
        _ => return expected.replace("an array of length", "a list of length").replace("a sequence", "a list"),
    };
    words.to_owned()
}

/// A value, as the text has it.
fn given(found: &str) -> String {
    match found {
        "unit value" => "null".to_owned(),
        "map" => "an object".to_owned(),
        "sequence" => "a list".to_owned(),
        _ => match found.split_once(' ') {
            Some(("integer" | "floating" | "boolean", rest)) => {
                rest.trim_start_matches("point ").trim_matches('`').to_owned()
            }
            Some(("string", text)) => format!("the string {text}"),
            _ => found.to_owned(),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields, rename_all = "snake_case")]
    #[expect(dead_code, reason = "it is parsed, and not read")]
    struct Box {
        size: [f64; 3],
        count: Option<u32>,
        kind: Option<Kind>,
    }

    #[derive(Debug, Deserialize)]
    #[serde(rename_all = "snake_case")]
    enum Kind {
        Wood,
        Paper,
    }

    #[test]
    fn faults_are_told_in_the_words_of_the_text() {
        for (text, words) in [
            ("{}", "the member \"size\" is missing"),
            (r#"{"size": [1, 2, 3], "size": [1, 2, 3]}"#, "the member \"size\" comes twice"),
            (r#"{"sizes": 1}"#, "there is no member \"sizes\"; known are: size, count, kind"),
            (r#"{"size": [1, 2]}"#, "it has 2 elements, and has to be a list of length 3"),
            (r#"{"size": [1, "x", 3]}"#, "it has to be a number, and is the string \"x\""),
            (r#"{"size": {}}"#, "it has to be a list of length 3, and is an object"),
            (r#"{"size": [1, 2, 3], "count": -1}"#, "it has to be a whole number, 0 or more, and is -1"),
            (r#"{"size": [1, 2, 3], "count": 1.5}"#, "it has to be a whole number, 0 or more, and is 1.5"),
            (r#"{"size": [1, 2, 3], "count": true}"#, "it has to be a whole number, 0 or more, and is true"),
            (r#"{"size": [1, 2, 3], "kind": "tin"}"#, "it cannot be \"tin\"; known are: wood, paper"),
            (r#"[1]"#, "it has to be a list of length 3, and is 1"),
            ("3", "it has to be an object, and is 3"),
        ] {
            let fault = serde_json::from_str::<Box>(text).expect_err(text).to_string();
            assert_eq!(plain(&fault), words, "{fault}");
        }
    }
}
