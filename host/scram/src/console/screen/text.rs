//! Text that fits: folded between words, or cut.

use ratatui::text::Span;

use super::theme::Theme;

/// Columns that a text takes.
pub fn width(text: &str) -> usize {
    Span::raw(text).width()
}

/// The beginning of a text that fits into some columns, marked where it was cut.
pub fn cut(text: &str, columns: usize, theme: Theme) -> String {
    if width(text) <= columns {
        return text.to_owned();
    }
    let mark = theme.ellipsis();
    let room = columns.saturating_sub(width(mark));
    let (head, _) = split(text, room);
    // Where there is no room for the mark there is little to be told anyway.
    if room == 0 { split(text, columns).0.to_owned() } else { format!("{}{mark}", head.trim_end()) }
}

/// Folds a text between its words, and within words that are longer than a row. At least one row, no row wider than
/// `columns` (but for a single character that is).
pub fn fold(text: &str, columns: usize) -> Vec<String> {
    let columns = columns.max(1);
    let mut rows = vec![String::new()];
    for word in text.split(' ') {
        let mut word = word;
        let row = rows.last_mut().expect("there is always one");
        if !row.is_empty() && width(row) + 1 + width(word) <= columns {
            row.push(' ');
            row.push_str(word);
            continue;
        }
        if !row.is_empty() {
            rows.push(String::new());
        }
        while width(word) > columns {
            let (head, tail) = split(word, columns);
            if tail.is_empty() {
                break;
            }
            rows.last_mut().expect("there is always one").push_str(head);
            rows.push(String::new());
            word = tail;
        }
        rows.last_mut().expect("there is always one").push_str(word);
    }
    rows
}

/// The part that fits, and the rest. At least one character, so that folding comes to an end.
fn split(text: &str, columns: usize) -> (&str, &str) {
    let mut used = 0;
    for (at, c) in text.char_indices() {
        used += width(c.encode_utf8(&mut [0; 4]));
        if used > columns && at > 0 {
            return text.split_at(at);
        }
    }
    (text, "")
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: Theme = Theme { colour: false, ascii: true };

    #[test]
    fn text_is_folded_between_words() {
        assert_eq!(fold("one two three", 7), ["one two", "three"]);
        assert_eq!(fold("", 7), [""]);
        assert_eq!(fold("abcdefgh ij", 3), ["abc", "def", "gh", "ij"]);
        assert_eq!(fold("漢字漢字", 5), ["漢字", "漢字"]);
        assert_eq!(fold("漢字", 1), ["漢", "字"]);
    }

    #[test]
    fn text_is_cut_where_it_does_not_fit() {
        assert_eq!(cut("a longer name", 8, PLAIN), "a lon...");
        assert_eq!(cut("a longer name", 8, Theme { colour: false, ascii: false }), "a longe…");
        assert_eq!(cut("fits", 4, PLAIN), "fits");
        assert_eq!(cut("漢字漢字", 6, PLAIN), "漢...");
        for columns in 0..20 {
            assert!(width(&cut("a longer name", columns, PLAIN)) <= columns.max(1));
        }
    }
}
