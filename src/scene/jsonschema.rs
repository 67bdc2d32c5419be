//! The form of a scene file as JSON Schema, draft 2020-12, for editors that complete and check as one types.

use serde_json::{Map, Value, json};

use super::keys::children;
use super::schema::{Given, Key, Kind, ONE_OF};
use super::tree::{Rank, Source, parse_value, plain};

/// JSON Schema of the scene file, with descriptions, units, ranges, choices and defaults. What only a part of
/// the program can tell (files that exist, checksums, limits between keys) is left to `nightglass check`.
pub fn json_schema() -> Value {
    let mut schema = Map::new();
    schema.insert("$schema".into(), "https://json-schema.org/draft/2020-12/schema".into());
    schema.insert("title".into(), "nightglass scene".into());
    schema.insert("description".into(), "A telescope, its night and its targets".into());
    schema.extend(object("", ""));
    Value::Object(schema)
}

/// The object of one table.
fn object(table: &str, doc: &str) -> Map<String, Value> {
    let mut out = Map::new();
    if !doc.is_empty() {
        out.insert("description".into(), doc.into());
    }
    out.insert("type".into(), "object".into());
    out.insert("additionalProperties".into(), false.into());
    let own = children(table).map(|key| (key.name().to_string(), property(key)));
    out.insert("properties".into(), Value::Object(own.collect()));
    let in_group = |key: &&Key| ONE_OF.iter().any(|(t, names)| *t == table && names.contains(&key.name()));
    let from_preset = ["station", "telescope", "detector"].contains(&table);
    let must =
        |key: &&Key| matches!(key.given, Given::Must(_)) && key.when.is_none() && !in_group(key) && !from_preset;
    let mut required: Vec<&str> = children(table).filter(must).map(Key::name).collect();
    required.extend(match table {
        "" => vec!["station", "exposures"],
        "target[]" => vec!["orbit"],
        _ => vec![],
    });
    if !required.is_empty() {
        out.insert("required".into(), json!(required));
    }
    for (_, members) in ONE_OF.iter().filter(|(t, _)| *t == table) {
        let mut choices: Vec<Value> = members.iter().map(|name| json!({ "required": [name] })).collect();
        if from_preset {
            let any: Vec<Value> = choices.clone();
            choices.push(json!({ "not": { "anyOf": any } }));
        }
        out.insert("oneOf".into(), Value::Array(choices));
    }
    out
}

/// One key or table.
fn property(key: &Key) -> Value {
    let mut doc = key.doc.to_string();
    if !key.unit.is_empty() {
        doc += &format!(" [{}]", key.unit);
    }
    if let Given::From(_, rule) = key.given {
        doc += &format!("; default: {rule}");
    }
    if let Some((selector, value)) = key.when {
        doc += &format!("; only with {selector} = \"{value}\"");
    }
    let mut out = match key.kind {
        Kind::Section | Kind::Maybe => return Value::Object(object(key.path, &doc)),
        Kind::Many => {
            return json!({ "description": doc, "type": "array", "items": object(key.path, "") });
        }
        Kind::Named => {
            let each = object(&format!("{}.*", key.path), "");
            return json!({ "description": doc, "type": "object", "additionalProperties": each });
        }
        _ => {
            let mut out = Map::from_iter([("description".to_string(), Value::String(doc))]);
            if let Value::Object(form) = form(key.kind) {
                out.extend(form);
            }
            out
        }
    };
    if !key.unit.is_empty() {
        out.insert("x-unit".into(), key.unit.into());
    }
    match key.given {
        Given::Is(text) => {
            out.insert("default".into(), literal(text));
        }
        Given::Must(text) | Given::From(text, _) | Given::Optional(text) => {
            out.insert("examples".into(), json!([literal(text)]));
        }
        Given::Nothing => {}
    }
    Value::Object(out)
}

/// What a kind of value may be.
fn form(kind: Kind) -> Value {
    let number = |low: f64, high: f64| json!({ "type": "number", "minimum": low, "maximum": high });
    let side = json!({ "type": "integer", "minimum": 1, "maximum": 65_536 });
    match kind {
        Kind::Text | Kind::Path | Kind::File(_) | Kind::Preset => json!({ "type": "string", "minLength": 1 }),
        Kind::Flag => json!({ "type": "boolean" }),
        Kind::Int(low, high) => json!({ "type": "integer", "minimum": low, "maximum": high }),
        Kind::IntOf(numbers) => json!({ "enum": numbers }),
        Kind::Real(low, high) => number(low, high),
        Kind::Above(low, high) => json!({ "type": "number", "exclusiveMinimum": low, "maximum": high }),
        Kind::Reals(count, low, high) => {
            json!({ "type": "array", "items": number(low, high), "minItems": count, "maxItems": count })
        }
        Kind::Size => {
            let both = json!({ "type": "array", "items": side, "minItems": 2, "maxItems": 2 });
            json!({ "anyOf": [side, both] })
        }
        Kind::Horizon => {
            let pair = json!({ "type": "array", "minItems": 2, "maxItems": 2, "items": false,
                "prefixItems": [number(0.0, 360.0), number(-90.0, 90.0)] });
            json!({ "type": "array", "items": pair, "minItems": 1 })
        }
        Kind::Domes => {
            let pair = json!({ "type": "array", "minItems": 2, "maxItems": 2, "items": false,
                "prefixItems": [number(0.0, 360.0), number(0.0, 1.0)] });
            json!({ "type": "array", "items": pair })
        }
        Kind::Time => json!({ "type": "string", "format": "date-time" }),
        Kind::Tle => {
            let lines = json!({ "type": "array", "items": { "type": "string" }, "minItems": 2, "maxItems": 3 });
            json!({ "anyOf": [lines, { "type": "string" }] })
        }
        Kind::Word(words) => json!({ "enum": words }),
        Kind::Words(words) => {
            json!({ "type": "array", "items": { "enum": words }, "uniqueItems": true })
        }
        Kind::WordOrReal(words, low, high) => {
            json!({ "anyOf": [{ "enum": words }, number(low, high)] })
        }
        Kind::WordOrFile(words, file) => {
            json!({ "anyOf": [{ "enum": words }, { "type": "string", "description": file }] })
        }
        Kind::WordOrTable(words, table) => json!({ "anyOf": [{ "enum": words }, loose(table)] }),
        Kind::Crop => {
            let whole = json!({ "type": "integer", "minimum": 0, "maximum": 65_536 });
            let sides = json!({ "type": "array", "items": whole, "minItems": 4, "maxItems": 4 });
            json!({ "anyOf": [{ "enum": ["none", "target"] }, sides] })
        }
        Kind::Section | Kind::Maybe | Kind::Many | Kind::Named => json!({}),
    }
}

/// A table of which no key is required.
fn loose(table: &str) -> Value {
    let mut out = object(table, "");
    out.remove("required");
    Value::Object(out)
}

/// A TOML value as JSON.
fn literal(text: &str) -> Value {
    let source = std::rc::Rc::new(Source { origin: String::new(), base: None, rank: Rank::Scene });
    let value = plain(&parse_value(text, &source).value);
    match value {
        toml::Value::Datetime(time) => time.to_string().into(),
        value => serde_json::to_value(value).unwrap_or(Value::Null),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_tells_ranges_units_choices_and_defaults() {
        let schema = json_schema();
        let latitude = &schema["properties"]["station"]["properties"]["latitude_deg"];
        assert_eq!((&latitude["minimum"], &latitude["maximum"]), (&json!(-90.0), &json!(90.0)));
        assert_eq!(latitude["x-unit"], "deg");
        let psf = &schema["properties"]["telescope"]["properties"]["psf"];
        assert_eq!(psf["default"], "moffat");
        let orbit = &schema["properties"]["target"]["items"]["properties"]["orbit"];
        assert_eq!(orbit["oneOf"].as_array().map(Vec::len), Some(6));
        assert_eq!(schema["required"], json!(["station", "exposures"]));
    }
}
