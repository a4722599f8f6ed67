//! Whether a document has the shape that its committed schema says.

use std::path::Path;

use serde_json::Value;

/// The members that a schema knows, those of what it refers to too; `None` where any may be there.
fn members<'a>(schema: &'a Value, root: &'a Value) -> Option<Vec<&'a String>> {
    let rules = schema.as_object()?;
    if rules.contains_key("additionalProperties") {
        return None;
    }
    let mut known: Vec<&String> = Vec::new();
    known.extend(
        rules.get("properties").and_then(Value::as_object).into_iter().flat_map(|object| object.keys()),
    );
    for rule in ["anyOf", "oneOf", "allOf"] {
        for schema in rules.get(rule).and_then(Value::as_array).into_iter().flatten() {
            known.extend(members(schema, root)?);
        }
    }
    if let Some(target) = rules.get("$ref") {
        known.extend(members(definition(target, root), root)?);
    }
    Some(known)
}

fn definition<'a>(target: &Value, root: &'a Value) -> &'a Value {
    let place = target.as_str().unwrap().trim_start_matches('#');
    root.pointer(place).unwrap_or_else(|| panic!("{target} is nowhere"))
}

/// What of `value` is not as `schema` says, or stands nowhere in it.
fn wrong(schema: &Value, root: &Value, value: &Value, place: &str, found: &mut Vec<String>) {
    if let (Some(known), Some(object)) = (members(schema, root), value.as_object()) {
        let unknown = object.keys().filter(|name| !known.contains(name));
        found.extend(unknown.map(|name| format!("{place}.{name}: stands in no schema")));
    }
    broken(schema, root, value, place, found);
}

/// The rules of `schema` that `value` breaks, those rules that the committed schemas have; any other is an error here.
/// `root` has the definitions.
fn broken(schema: &Value, root: &Value, value: &Value, place: &str, found: &mut Vec<String>) {
    let ok = |schema: &Value| {
        let mut found = Vec::new();
        broken(schema, root, value, place, &mut found);
        found.is_empty()
    };
    let Some(rules) = schema.as_object() else {
        if schema == &Value::Bool(false) {
            found.push(format!("{place}: must not be there"));
        }
        return;
    };
    let no_items = Vec::new();
    for (rule, wanted) in rules {
        let list = wanted.as_array().unwrap_or(&no_items);
        let holds = match rule.as_str() {
            "title" | "description" | "$schema" | "$defs" | "format" | "default" => true,
            "type" => {
                let is = |name: &Value| match name.as_str().unwrap() {
                    "null" => value.is_null(),
                    "boolean" => value.is_boolean(),
                    "string" => value.is_string(),
                    "array" => value.is_array(),
                    "object" => value.is_object(),
                    "number" => value.is_number(),
                    "integer" => value.is_i64() || value.is_u64(),
                    other => panic!("{place}: type {other}"),
                };
                if wanted.is_array() { list.iter().any(is) } else { is(wanted) }
            }
            "minimum" => value.as_f64().is_none_or(|value| value >= wanted.as_f64().unwrap()),
            "maximum" => value.as_f64().is_none_or(|value| value <= wanted.as_f64().unwrap()),
            "minItems" => value.as_array().is_none_or(|items| items.len() as u64 >= wanted.as_u64().unwrap()),
            "maxItems" => value.as_array().is_none_or(|items| items.len() as u64 <= wanted.as_u64().unwrap()),
            "const" => value == wanted,
            "enum" => list.contains(value),
            "anyOf" => list.iter().any(ok),
            "oneOf" => list.iter().filter(|schema| ok(schema)).count() == 1,
            "allOf" => list.iter().all(ok),
            "required" => list.iter().all(|name| value.get(name.as_str().unwrap()).is_some()),
            "$ref" => {
                broken(definition(wanted, root), root, value, place, found);
                true
            }
            "items" => {
                for (i, item) in value.as_array().into_iter().flatten().enumerate() {
                    wrong(wanted, root, item, &format!("{place}[{i}]"), found);
                }
                true
            }
            "properties" => {
                for (name, schema) in wanted.as_object().unwrap() {
                    if let Some(value) = value.get(name) {
                        wrong(schema, root, value, &format!("{place}.{name}"), found);
                    }
                }
                true
            }
            "additionalProperties" => {
                for (name, value) in value.as_object().into_iter().flatten() {
                    if rules.get("properties").is_none_or(|known| known.get(name).is_none()) {
                        wrong(wanted, root, value, &format!("{place}.{name}"), found);
                    }
                }
                true
            }
            other => panic!("{place}: the schemas have come to use {other}"),
        };
        if !holds {
            found.push(format!("{place}: {rule} {wanted}"));
        }
    }
}

/// Asserts that a document has the shape that docs/schema/json/NAME.schema.json says.
pub(crate) fn valid(name: &str, document: &Value) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/schema/json");
    let schema = std::fs::read_to_string(folder.join(format!("{name}.schema.json"))).unwrap();
    let schema: Value = serde_json::from_str(&schema).unwrap();
    let against = |document: &Value| {
        let mut found = Vec::new();
        wrong(&schema, &schema, document, "$", &mut found);
        found
    };
    let found = against(document);
    assert!(found.is_empty(), "{name}: {found:#?} in {document:#}");
    assert!(!against(&Value::Null).is_empty(), "{name} takes anything");
    assert!(!against(&serde_json::json!({ "velvet": 1 })).is_empty(), "{name} takes any member");
}
