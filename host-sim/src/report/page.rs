//! One HTML file that needs no network: text, tables and charts, readable in light and dark.
//!
//! plotly.js stands in the file once: its `basic` bundle (MIT, from the npm package plotly.js-basic-dist-min), which
//! has lines and points and a quarter of the whole library's size. Charts are data in
//! `<script type="application/json">` and are drawn by `script.js`, which knows both colour schemes; where no script
//! runs, a still picture stands in their place. A page ends with where it comes from ([`crate::provenance`]).

use std::fmt::Write;

use super::chart::Chart;

/// A page.
#[derive(Debug, Clone, Default)]
pub struct Page {
    /// Title of the page.
    pub title: String,
    /// The sentence that stands first.
    pub lead: String,
    /// All else, in order.
    pub blocks: Vec<Block>,
}

/// A piece of a page.
#[derive(Debug, Clone)]
pub enum Block {
    /// A heading, with the name a link goes to.
    Heading(String),
    /// A paragraph.
    Text(String),
    /// A list of paragraphs.
    List(Vec<String>),
    /// A table.
    Table(Table),
    /// A chart.
    Chart(Chart),
}

/// A table; the first column names the row.
#[derive(Debug, Clone, Default)]
pub struct Table {
    /// Heading of each column.
    pub head: Vec<String>,
    /// Cells of each row.
    pub rows: Vec<Vec<String>>,
}

impl Page {
    /// The page as HTML.
    #[must_use]
    pub fn to_html(&self) -> String {
        // A chart of a closed loop takes some hundred kilobytes.
        let mut body = String::with_capacity(1 << 19);
        let mut contents = String::new();
        let mut charts = 0;
        let mut headings = 0;
        for block in &self.blocks {
            match block {
                Block::Heading(text) => {
                    headings += 1;
                    let text = escape(text);
                    let _ = writeln!(body, "<h2 id=\"part{headings}\">{text}</h2>");
                    let _ = write!(contents, "<a href=\"#part{headings}\">{text}</a>");
                }
                Block::Text(text) => {
                    let _ = writeln!(body, "<p>{}</p>", rich(text));
                }
                Block::List(items) => {
                    let items: String = items.iter().map(|i| format!("<li>{}</li>", rich(i))).collect();
                    let _ = writeln!(body, "<ul>{items}</ul>");
                }
                Block::Table(table) => body.push_str(&table.to_html()),
                Block::Chart(chart) => {
                    charts += 1;
                    let _ = writeln!(
                        body,
                        "<figure><figcaption><strong>{}</strong> {}</figcaption>\
                         <div class=\"chart\" id=\"chart{charts}\" data-panels=\"{}\"></div><noscript>{}</noscript>\
                         <script type=\"application/json\" data-chart=\"chart{charts}\">{}</script></figure>",
                        escape(&chart.title),
                        rich(&chart.caption),
                        chart.panels.len(),
                        super::picture::svg(chart),
                        chart.to_json(),
                    );
                }
            }
        }
        let title = escape(&self.title);
        let lead = rich(&self.lead);
        let (library, script, hint) = if charts > 0 {
            (plotly_js(), include_str!("script.js"), include_str!("hint.html"))
        } else {
            (String::new(), "", "")
        };
        let style = include_str!("style.css");
        let footer = footer();
        let contents = if headings > 2 { format!("<nav>{contents}</nav>") } else { String::new() };
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n<title>{title}</title>\n\
             <style>\n{style}</style>\n{library}</head>\n<body>\n<main>\n<h1>{title}</h1>\n\
             <p class=\"lead\">{lead}</p>\n{contents}{hint}{body}{footer}</main>\n<script>\n{script}</script>\n</body>\n</html>\n"
        )
    }
}

impl Table {
    fn to_html(&self) -> String {
        let cell = |tag: &str, text: &str| {
            format!("<{tag}>{}</{}>", rich(text), tag.split(' ').next().unwrap_or_default())
        };
        let head: String = self.head.iter().map(|t| cell("th scope=\"col\"", t)).collect();
        let rows: String = self
            .rows
            .iter()
            .map(|row| {
                let cells: String = row
                    .iter()
                    .enumerate()
                    .map(|(k, t)| cell(if k == 0 { "th scope=\"row\"" } else { "td" }, t))
                    .collect();
                format!("<tr>{cells}</tr>\n")
            })
            .collect();
        format!(
            "<div class=\"table\"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{rows}</tbody></table></div>\n"
        )
    }
}

/// The library.
fn plotly_js() -> String {
    format!("<script>\n{}</script>\n", include_str!("plotly-basic.min.js"))
}

/// Where the page comes from.
fn footer() -> String {
    let rows: String = crate::provenance::lines()
        .iter()
        .map(|(what, value)| {
            format!("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", escape(what), escape(value))
        })
        .collect();
    format!(
        "<footer>\n<h2>Where this comes from</h2>\n<div class=\"table\"><table>\n{rows}</table></div>\n</footer>\n"
    )
}

/// Text that is safe in HTML.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Safe text in which a single letter or digit after an underscore is a subscript: F_N, µ_s, k_u.
fn rich(text: &str) -> String {
    let safe = escape(text);
    let letters: Vec<char> = safe.chars().collect();
    let mut out = String::with_capacity(safe.len());
    let mut k = 0;
    while k < letters.len() {
        let at = |i: usize| letters.get(i).copied().unwrap_or(' ');
        let single =
            at(k) == '_' && at(k + 1).is_alphanumeric() && !at(k + 2).is_alphanumeric() && at(k + 2) != '_';
        let symbol = k > 0
            && at(k - 1).is_alphabetic()
            && (k < 2 || !(at(k - 2).is_alphanumeric() || at(k - 2) == '_'));
        if single && symbol {
            let _ = write!(out, "<sub>{}</sub>", at(k + 1));
            k += 2;
        } else {
            out.push(at(k));
            k += 1;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_needs_no_network_and_escapes_what_it_shows() {
        let page = Page {
            title: "A < B".into(),
            lead: "Lead & more.".into(),
            blocks: vec![
                Block::Heading("One".into()),
                Block::Table(Table { head: vec!["<x>".into()], rows: vec![vec!["1".into()]] }),
                Block::Chart(Chart { title: "C".into(), ..Chart::default() }),
            ],
        };
        let html = page.to_html();
        assert!(html.contains("<h1>A &lt; B</h1>") && html.contains("Lead &amp; more."));
        assert!(html.contains("Plotly"));
        // Nothing is loaded from anywhere: no src, no stylesheet, no import.
        let library = plotly_js();
        assert!((900_000..1_200_000).contains(&library.len()), "{} bytes", library.len());
        let own = html.replace(&library, "").replace("http://www.w3.org/2000/svg", "");
        for forbidden in ["src=", "<link", "@import", "http:", "https:", "fetch("] {
            assert!(!own.contains(forbidden), "{forbidden}");
        }
        assert!(!library.contains("<script src") && library.matches("</script>").count() == 1);
        assert!(html.contains("<th scope=\"col\">&lt;x&gt;</th>") && html.contains("<noscript>"));
        assert!(html.contains("Where this comes from") && html.contains(env!("CARGO_PKG_VERSION")));
    }

    #[test]
    fn symbols_get_their_subscripts_and_names_keep_their_underscores() {
        assert_eq!(rich("F_N g(v), µ_s"), "F<sub>N</sub> g(v), µ<sub>s</sub>");
        assert_eq!(rich("normal_force_n, a_b_c"), "normal_force_n, a_b_c");
    }

    #[test]
    fn a_page_without_charts_does_not_carry_the_library() {
        let page = Page { title: "T".into(), ..Page::default() };
        assert!(page.to_html().len() < 20_000);
    }
}
