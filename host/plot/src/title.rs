//! A title over a picture that is drawn already: which run it shows.

use crate::report::svg::escape;

/// Height of the title, pixels.
const HEIGHT: f64 = 34.0;

/// An SVG under a line of text. What is no SVG with a width and a height comes back as it is.
#[must_use]
pub fn under_title(title: &str, svg: &str) -> String {
    let Some((start, size)) = svg.find("<svg").zip(size(svg)) else { return svg.to_owned() };
    let (width, height) = size;
    let text = escape(title);
    let inner = svg[start..].replacen("<svg", &format!("<svg y=\"{HEIGHT}\""), 1);
    format!(
        "<svg width=\"{width}\" height=\"{full}\" viewBox=\"0 0 {width} {full}\" xmlns=\"http://www.w3.org/2000/svg\">\n\
         <title>{text}</title>\n<rect width=\"{width}\" height=\"{full}\" fill=\"#FFFFFF\"/>\n\
         <text x=\"20\" y=\"23\" font-family=\"sans-serif\" font-size=\"15\" font-weight=\"bold\" fill=\"#282828\">{text}</text>\n\
         {inner}\n</svg>\n",
        full = height + HEIGHT,
    )
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
    }
}
