//! A title over a picture that is drawn already: which run it shows.

use crate::report::svg::escape;

/// Height of a title of one line, and of every further line, pixels.
const HEIGHT: f64 = 34.0;
const LINE: f64 = 20.0;
/// Mean width of a character, pixels, and how many a line has at least.
const CHARACTER: f64 = 9.3;
const LEAST: usize = 40;

/// An SVG under a text, in as many lines as its width takes. What is no SVG with a width and a height comes back as it is.
#[must_use]
pub fn under_title(title: &str, svg: &str) -> String {
    let Some((start, size)) = svg.find("<svg").zip(size(svg)) else { return svg.to_owned() };
    let (width, height) = size;
    let text = escape(title);
    let lines = broken(title, (((width - 40.0) / CHARACTER) as usize).max(LEAST));
    let above = HEIGHT + LINE * lines.len().saturating_sub(1) as f64;
    let lines: String = lines
        .iter()
        .enumerate()
        .map(|(index, line)| {
            format!(
                "<text x=\"20\" y=\"{}\" font-family=\"sans-serif\" font-size=\"15\" font-weight=\"bold\" \
                 fill=\"#282828\">{}</text>\n",
                23.0 + LINE * index as f64,
                escape(line)
            )
        })
        .collect();
    let inner = svg[start..].replacen("<svg", &format!("<svg y=\"{above}\""), 1);
    format!(
        "<svg width=\"{width}\" height=\"{full}\" viewBox=\"0 0 {width} {full}\" xmlns=\"http://www.w3.org/2000/svg\">\n\
         <title>{text}</title>\n<rect width=\"{width}\" height=\"{full}\" fill=\"#FFFFFF\"/>\n\
         {lines}{inner}\n</svg>\n",
        full = height + above,
    )
}

/// The words of a text in lines of so many characters.
fn broken(text: &str, most: usize) -> Vec<String> {
    let mut lines: Vec<String> = vec![String::new()];
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if line.is_empty() => line.push_str(word),
            Some(line) if line.chars().count() + 1 + word.chars().count() <= most => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// Width and height of an SVG, pixels.
fn size(svg: &str) -> Option<(f64, f64)> {
    let head = svg.get(svg.find("<svg")?..)?.split('>').next()?;
    let number = |name: &str| head.split(&format!(" {name}=\"")).nth(1)?.split('"').next()?.parse().ok();
    Some((number("width")?, number("height")?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_title_is_text_above_the_whole_picture() {
        let inner =
            "<svg width=\"10\" height=\"20\" viewBox=\"0 0 10 20\" xmlns=\"http://www.w3.org/2000/svg\"><g/></svg>";
        let titled = under_title("a <robot> & its drive", inner);
        let document = roxmltree::Document::parse(&titled).unwrap();
        let root = document.root_element();
        assert_eq!((root.attribute("width"), root.attribute("height")), (Some("10"), Some("54")));
        let texts: Vec<_> = root.children().filter(|node| node.has_tag_name("text")).filter_map(|n| n.text()).collect();
        assert_eq!(texts, ["a <robot> & its drive"]);
        let nested = root.children().find(|node| node.tag_name().name() == "svg").unwrap();
        assert_eq!((nested.attribute("y"), nested.attribute("height")), (Some("34"), Some("20")));
        assert_eq!(under_title("title", "no picture"), "no picture");
        let long = under_title("scram-26, freq:7 for 2 s, seed 1, sensor-open@1, on the ground", inner);
        let document = roxmltree::Document::parse(&long).unwrap();
        let root = document.root_element();
        let texts: Vec<_> = root.children().filter(|node| node.has_tag_name("text")).filter_map(|n| n.text()).collect();
        assert_eq!(texts, ["scram-26, freq:7 for 2 s, seed 1,", "sensor-open@1, on the ground"]);
        assert_eq!(root.attribute("height"), Some("74"));
    }
}
