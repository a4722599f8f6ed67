//! Pages of HTML that need no other file but the pictures they show.

/// Colours and lengths are chosen by eye.
const STYLE: &str = include_str!("page.css");

/// A page in light or dark, as the reader's system is, for screens of any width.
pub(crate) fn page(title: &str, body: &str) -> String {
    format!(
        "<!doctype html>
<html lang=\"en\">
<meta charset=\"utf-8\">
<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">
<title>{title}</title>
<style>
{STYLE}</style>
<main>
{body}</main>
</html>
"
    )
}

/// A mip level in words: how large its texture is beside the one that was authored.
pub(crate) fn level_words(level: u32) -> String {
    match level {
        0 => "as authored".into(),
        1 => "half size".into(),
        2 => "quarter size".into(),
        _ => format!("1/{} size", 1u64 << level.min(63)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_named_by_their_size() {
        assert_eq!(
            [0, 1, 2, 3, 10].map(level_words).join(", "),
            "as authored, half size, quarter size, 1/8 size, 1/1024 size"
        );
    }
}
