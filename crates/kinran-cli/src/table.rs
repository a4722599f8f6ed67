//! Aligned text.

/// Rows of cells as lines: the first column to the left, the others to the right, two spaces between.
pub(crate) fn table(rows: &[Vec<String>]) -> String {
    aligned(rows, |column| column > 0)
}

/// Rows of cells as lines, all columns to the left.
pub(crate) fn list(rows: &[Vec<String>]) -> String {
    aligned(rows, |_| false)
}

fn aligned(rows: &[Vec<String>], to_the_right: impl Fn(usize) -> bool) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let cell_width = |cell: &String| cell.chars().count();
    let widths: Vec<usize> = (0..columns)
        .map(|column| rows.iter().filter_map(|row| row.get(column)).map(cell_width).max().unwrap_or(0))
        .collect();
    let mut text = String::new();
    for row in rows {
        let cells = row.iter().zip(&widths).enumerate().map(|(column, (cell, &width))| {
            if to_the_right(column) { format!("{cell:>width$}") } else { format!("{cell:<width$}") }
        });
        text += cells.collect::<Vec<_>>().join("  ").trim_end();
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up_though_rows_are_short_or_not_ascii() {
        let cell = |text: &str| text.to_owned();
        let rows = [vec![cell("level"), cell("µ")], vec![cell("0"), cell("0.25")], vec![cell("x")]];
        assert_eq!(table(&rows), "level     µ\n0      0.25\nx\n");
        assert_eq!(list(&rows), "level  µ\n0      0.25\nx\n");
        assert_eq!(table(&[]), "");
    }
}
