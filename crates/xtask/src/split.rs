//! A translated text taken apart at its top-level declarations.

use std::collections::BTreeSet;

use crate::{Error, source::words};

/// A declaration as naga wrote it.
pub(crate) struct Chunk {
    /// What it declares.
    pub(crate) name: String,
    /// Its text, each line ended.
    pub(crate) text: String,
}

/// All declarations of a text in GLSL, HLSL or MSL, in order. Directives and `using` lines are left out.
pub(crate) fn split(text: &str) -> Result<Vec<Chunk>, Error> {
    let mut chunks = Vec::new();
    let mut open = String::new();
    for line in text.lines() {
        let between = open.is_empty();
        let is_directive =
            line.starts_with('#') || line.starts_with("using ") || line.starts_with("precision ");
        if between && (line.trim().is_empty() || line.starts_with("//") || is_directive) {
            continue;
        }
        open += &format!("{}\n", without_parentheses(line.trim_end()));
        let depth = open.matches('{').count().checked_sub(open.matches('}').count());
        if depth.ok_or("a brace too many")? == 0 && line.trim_end().ends_with(['}', ';']) {
            let text = std::mem::take(&mut open);
            chunks.push(Chunk { name: declared(&text)?.to_owned(), text });
        }
    }
    if open.is_empty() { Ok(chunks) } else { Err(format!("a declaration has no end: {open}").into()) }
}

/// A line whose whole expression naga put in parentheses, without them; DXC warns of them around a comparison.
fn without_parentheses(line: &str) -> String {
    for (before, after) in [("return (", ");"), (" = (", ");"), ("if ((", ")) {")] {
        let Some((head, rest)) = line.split_once(before) else { continue };
        let Some(inner) = rest.strip_suffix(after) else { continue };
        let mut depth = 0;
        let is_one_pair = inner.chars().all(|c| {
            depth += i32::from(c == '(') - i32::from(c == ')');
            depth >= 0
        });
        if is_one_pair {
            return format!("{head}{}{inner}{}", before.replacen('(', "", 1), after.replacen(')', "", 1));
        }
    }
    line.to_owned()
}

/// The name a declaration declares: after `struct`, before the parameters of a function, before the `=` of a
/// constant, or last in a `typedef`.
fn declared(text: &str) -> Result<&str, Error> {
    let head = text.split(['(', '=', '{', ';']).next().unwrap_or_default();
    let head = head.split_once("struct ").map_or(head, |(_, after)| after);
    // float name[9]
    let head = if text.contains('(') && !text.starts_with("typedef") {
        head
    } else {
        head.split('[').next().unwrap_or_default()
    };
    words(head).last().ok_or_else(|| format!("what does this declare? {text}").into())
}

/// naga numbers the parameters and variables of all functions together: `h`, `h_1`, `h_2`. In each chunk, takes the
/// number off where that leaves one thing of the name.
pub(crate) fn unnumber(chunks: &mut [Chunk]) {
    let everywhere: BTreeSet<String> =
        chunks.iter().flat_map(|c| identifiers(&c.text)).map(str::to_owned).collect();
    let globals: BTreeSet<String> = chunks.iter().map(|c| c.name.clone()).collect();
    for chunk in chunks {
        let here: BTreeSet<String> = identifiers(&chunk.text).map(str::to_owned).collect();
        let base = |word: &str| {
            let (base, number) = word.rsplit_once('_')?;
            (!number.is_empty() && number.bytes().all(|b| b.is_ascii_digit())).then(|| base.to_owned())
        };
        let is_free = |word: &String| {
            base(word).is_some_and(|base_of_word| {
                // Where the first of a name is `name_`, `name` is a word of the language.
                everywhere.contains(&base_of_word)
                    && !everywhere.contains(&format!("{base_of_word}_"))
                    && !here.contains(&base_of_word)
                    && !globals.contains(&base_of_word)
                    && here.iter().filter(|other| base(other).as_ref() == Some(&base_of_word)).count() == 1
            })
        };
        for word in here.iter().filter(|word| !globals.contains(*word) && is_free(word)) {
            chunk.text = replace_word(&chunk.text, word, &base(word).unwrap_or_default());
        }
    }
}

/// The words of a text that name no member.
fn identifiers(text: &str) -> impl Iterator<Item = &str> {
    words(text).filter(|word| {
        let at = word.as_ptr() as usize - text.as_ptr() as usize;
        !text[..at].ends_with('.')
    })
}

fn replace_word(text: &str, from: &str, to: &str) -> String {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    let mut replaced = String::new();
    let mut rest = text;
    while let Some(at) = rest.find(from) {
        let (before, after) = (&rest[..at], &rest[at + from.len()..]);
        let is_whole = !before.ends_with(is_part) && !after.starts_with(is_part);
        replaced += before;
        replaced += if is_whole { to } else { from };
        rest = after;
    }
    replaced + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn declarations_are_found_under_their_names() {
        let text = "#version 450\n\nstruct Pair {\n    int a;\n};\ntypedef float ret_of[9];\n\
            const float HALF = max(0.5, 0.25);\nret_of of(\n    Pair p\n) {\n    if (true) {\n    }\n}\n";
        let names: Vec<_> = split(text).unwrap().into_iter().map(|chunk| chunk.name).collect();
        assert_eq!(names, ["Pair", "ret_of", "HALF", "of"]);
    }

    #[test]
    fn only_parentheses_around_everything_go() {
        for (line, wanted) in [
            ("return (a * (b + c));", "return a * (b + c);"),
            ("float x = ((a) + (b));", "float x = (a) + (b);"),
            ("if ((a == b)) {", "if (a == b) {"),
            ("return (a) * (b);", "return (a) * (b);"),
            ("if ((a) || (b)) {", "if ((a) || (b)) {"),
        ] {
            assert_eq!(without_parentheses(line), wanted);
        }
    }

    #[test]
    fn a_number_is_kept_where_the_name_without_it_means_something_else() {
        let unnumbered = |texts: [&str; 2]| {
            let chunk = |text: &str| Chunk { name: text[..1].to_owned(), text: text.to_owned() };
            let mut chunks = texts.map(chunk);
            unnumber(&mut chunks);
            chunks.map(|chunk| chunk.text)
        };
        assert_eq!(unnumbered(["f(x, v.x)", "g(x_1, v_2.x)"]), ["f(x, v.x)", "g(x, v.x)"]);
        // Two of the name in one function, a function of the name, a word of the language.
        assert_eq!(unnumbered(["f(x)", "g(x_1, x_2)"])[1], "g(x_1, x_2)");
        assert_eq!(unnumbered(["f(x)", "g(f_1, f)"])[1], "g(f_1, f)");
        assert_eq!(unnumbered(["f(half_)", "g(half_1, half)"])[1], "g(half_1, half)");
    }
}
