//! What little of XML describes a stream: elements with text, without attributes that matter.

/// The texts inside of each element `tag`, nested ones of the same name as part of the outer.
pub(super) fn elements<'a>(xml: &'a str, tag: &'a str) -> impl Iterator<Item = &'a str> {
    let mut rest = xml;
    std::iter::from_fn(move || {
        let (inside, behind) = next(rest, tag)?;
        rest = behind;
        Some(inside)
    })
}

/// The text of the first element `tag`, unescaped; [`None`] where there is none or nothing in it.
pub(super) fn text(xml: &str, tag: &str) -> Option<String> {
    let inside = next(xml, tag)?.0.trim();
    let plain = inside.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"").replace("&apos;", "'").replace("&amp;", "&");
    (!plain.is_empty() && !inside.contains('<')).then_some(plain)
}

/// The first element `tag`: what is in it, and what follows.
fn next<'a>(xml: &'a str, tag: &str) -> Option<(&'a str, &'a str)> {
    let mut at = 0;
    loop {
        at += xml[at..].find('<')? + 1;
        let Some(behind) = xml[at..].strip_prefix(tag) else { continue };
        if !behind.starts_with(|c: char| c == '>' || c == '/' || c.is_whitespace()) {
            continue;
        }
        let (attributes, content) = behind.split_once('>')?;
        if attributes.ends_with('/') {
            return Some(("", content));
        }
        return content.split_once(&format!("</{tag}>"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_are_found_by_their_whole_name() {
        let xml = "<?xml version=\"1.0\"?><info><channel_count>2</channel_count><channels><channel><label>A&amp;B</label><unit/></channel>\
            <channel id=\"2\"><label>C</label></channel></channels></info>";
        assert_eq!(text(xml, "channel_count").as_deref(), Some("2"));
        let channels: Vec<&str> = elements(xml, "channel").collect();
        assert_eq!(channels.len(), 2);
        assert_eq!((text(channels[0], "label").as_deref(), text(channels[0], "unit")), (Some("A&B"), None));
        assert_eq!(text(channels[1], "label").as_deref(), Some("C"));
        assert_eq!(text("<name>open", "name"), None);
    }
}
