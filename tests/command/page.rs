//! The page of `hbao paper` in a browser: what its readers see, at three widths, in light and dark, with and without
//! scripts, and on paper. The tests are skipped where Chromium is missing.

mod browser;

use crate::paper::made;
use browser::Browser;
use tempfile::TempDir;

const WIDTHS: [u32; 4] = [400, 800, 1200, 1600];

/// Opens the page, alone in a folder, in a browser. The folder lasts as long as its handle.
fn open(width: u32, scripts: bool) -> Option<(Browser, TempDir)> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("page.html");
    std::fs::write(&path, made().page()).unwrap();
    Some((Browser::open(&path, width, scripts)?, folder))
}

/// Elements that reach beyond the window, other than inside a box that scrolls or is cut off by itself.
const OVERFLOWING: &str = "
    [...document.querySelectorAll('body *')].filter(element => {
        const box = element.getBoundingClientRect();
        if (box.width === 0 || (box.right <= innerWidth + 0.5 && box.left >= -0.5)) return false;
        for (let around = element.parentElement; around; around = around.parentElement) {
            if (getComputedStyle(around).overflowX !== 'visible') return false;
        }
        return true;
    }).map(element => element.outerHTML.slice(0, 120))";

#[test]
fn nothing_overflows_from_400_to_1600_pixels_of_width() {
    for scripts in [true, false] {
        let Some((browser, _folder)) = open(400, scripts) else { return };
        for width in WIDTHS {
            browser.resize(width);
            assert_eq!(browser.value("innerWidth"), width);
            let widest = browser.value("document.scrollingElement.scrollWidth").as_u64().unwrap();
            assert!(widest <= u64::from(width), "at {width}, the page is {widest} pixels wide");
            browser.assert_none(&format!("beyond the window at {width}"), OVERFLOWING);
        }
        browser.assert_quiet();
    }
}

#[test]
fn the_contents_stay_in_sight_and_lead_to_what_they_name() {
    let Some((browser, _folder)) = open(400, false) else { return };
    for width in WIDTHS {
        browser.resize(width);
        browser.value("location.hash = '#tables'");
        browser.until("scrollY > innerHeight");
        let nav = if width >= 1200 { "nav.beside" } else { "nav.above" };
        let in_sight = format!(
            "(() => {{ const box = document.querySelector('{nav}').getBoundingClientRect(); \
             return box.height > 20 && box.top >= 0 && box.top < innerHeight; }})()"
        );
        assert_eq!(browser.value(&in_sight), true, "{nav} at {width}");
        // The heading is not behind the bar of the contents.
        let bar = "Math.max(0, document.querySelector('nav.above').getBoundingClientRect().bottom)";
        let top = "document.querySelector('#tables').getBoundingClientRect().top";
        assert_eq!(browser.value(&format!("{top} >= {bar}")), true, "{width}");
        if nav == "nav.above" {
            let shown = "document.querySelector('nav.above ul').checkVisibility({ contentVisibilityAuto: true })";
            assert_eq!(browser.value(shown), false, "{width}");
            browser.point("nav.above summary", 0.1, true);
            browser.until(shown);
            browser.point("nav.above summary", 0.1, true);
        }
        browser.value("location.hash = ''");
    }
}

#[test]
fn the_slider_moves_the_divider_and_blink_blinks() {
    let Some((browser, _folder)) = open(800, true) else { return };
    let boxes = browser.value("document.querySelectorAll('.compare').length").as_u64().unwrap();
    assert!(boxes > 4, "{boxes}");
    // Each box compares two pictures.
    browser.assert_none(
        "boxes without two pictures",
        "[...document.querySelectorAll('.compare')].filter(box => box.querySelectorAll('.stage img[src]').length !== 2)
            .map(box => box.parentElement.id)",
    );
    let divider = || {
        let share = browser.value(
            "(() => { const stage = document.querySelector('.compare .stage').getBoundingClientRect();
                const divider = document.querySelector('.compare .divider').getBoundingClientRect();
                return (divider.left + divider.width / 2 - stage.left) / stage.width; })()",
        );
        let cut = browser.value("document.querySelector('.compare .over').style.clipPath");
        let cut = cut.as_str().unwrap().split(' ').nth(1).unwrap().trim_end_matches('%').parse::<f64>().unwrap();
        assert!((1.0 - cut / 100.0 - share.as_f64().unwrap()).abs() < 0.05, "{cut} {share}");
        share.as_f64().unwrap()
    };
    assert!((divider() - 0.5).abs() < 0.03);
    browser.point(".compare input", 0.2, true);
    assert!((divider() - 0.2).abs() < 0.06, "{}", divider());
    browser.point(".compare .stage", 0.75, true);
    assert!((divider() - 0.75).abs() < 0.06, "{}", divider());

    let hidden = "getComputedStyle(document.querySelector('.compare .over')).visibility === 'hidden'";
    browser.point(".compare button", 0.5, true);
    for _ in 0..2 {
        browser.until(hidden);
        browser.until(&format!("!({hidden})"));
    }
    browser.point(".compare button", 0.5, true);
    browser.until(&format!("!({hidden}) && document.querySelector('.compare button').textContent === 'blink'"));
    assert!((divider() - 0.75).abs() < 0.06);
    browser.assert_quiet();
}

#[test]
fn without_scripts_every_section_is_legible_and_a_click_opens_a_picture_at_full_size() {
    let Some((browser, _folder)) = open(400, false) else { return };
    assert_eq!(browser.value("document.querySelectorAll('.compare .controls').length"), 0, "scripts run");
    browser.assert_none(
        "sections without text, or pictures that are not drawn",
        "[...document.querySelectorAll('main section, main figure')].filter(part => !part.innerText.trim())
            .concat([...document.images].filter(image => !image.naturalWidth || image.width < 20))
            .map(part => part.id || part.alt)",
    );
    // A picture that is wider than the window, whatever its size in pixels.
    browser.value("document.querySelector('.picture img').setAttribute('width', 900)");
    let image = "document.querySelector('.picture img').getBoundingClientRect()";
    let before = browser.value(&format!("{image}.width")).as_f64().unwrap();
    assert!(before < 400.0, "{before}");
    browser.point(".picture .open", 0.5, true);
    browser.until(&format!("{image}.width >= 900"));
    let covers = "document.elementFromPoint(innerWidth - 30, innerHeight - 30).closest('.sheet') !== null";
    assert_eq!(browser.value(covers), true);
    browser.point(".picture .close", 0.5, true);
    browser.until(&format!("{image}.width < 400 && {image}.bottom > 0 && {image}.top < innerHeight"));
}

/// Text whose contrast with what is behind it is less than 4.5, as the accessibility guidelines count it.
const FAINT: &str = "(() => {
    const parts = colour => colour.match(/[\\d.]+/g).map(Number);
    const luminance = colour => {
        const [r, g, b] = parts(colour).map(v => v / 255).map(v => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
        return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const behind = element => {
        for (let around = element; around; around = around.parentElement) {
            const colour = getComputedStyle(around).backgroundColor;
            if (parts(colour)[3] !== 0) return colour;
        }
        return 'rgb(255, 255, 255)';
    };
    const own = element => [...element.childNodes].some(node => node.nodeType === 3 && node.data.trim());
    return [...document.querySelectorAll('body *:not(script, option, svg *)')].filter(own)
        .filter(element => element.getBoundingClientRect().width > 0)
        .map(element => {
            const both = [getComputedStyle(element).color, behind(element)].map(luminance).sort((a, b) => b - a);
            return [(both[0] + 0.05) / (both[1] + 0.05), element];
        })
        .filter(([contrast]) => contrast < 4.5)
        .map(([contrast, element]) => `${contrast.toFixed(2)} ${element.outerHTML.slice(0, 120)}`);
})()";

#[test]
fn text_and_the_frames_of_pictures_are_seen_in_light_and_in_dark() {
    let Some((browser, _folder)) = open(1600, true) else { return };
    let mut backs = Vec::new();
    for scheme in ["light", "dark"] {
        browser.emulate("screen", scheme);
        browser.assert_none(&format!("faint text in {scheme}"), FAINT);
        browser.assert_none(
            "pictures without a frame",
            "[...document.querySelectorAll('.picture img, .drawing svg, .stage')].filter(picture => {
                const style = getComputedStyle(picture);
                return style.borderStyle !== 'solid' || parseFloat(style.borderWidth) < 1
                    || style.borderColor === getComputedStyle(document.body).backgroundColor;
            }).map(picture => picture.outerHTML.slice(0, 80))",
        );
        backs.push(browser.value("getComputedStyle(document.body).backgroundColor"));
    }
    assert_ne!(backs[0], backs[1], "dark looks like light");
    browser.assert_quiet();
}

#[test]
fn no_labels_of_a_drawing_collide() {
    let Some((browser, _folder)) = open(1600, false) else { return };
    assert!(browser.value("document.querySelectorAll('svg text').length").as_u64().unwrap() > 100);
    browser.assert_none(
        "labels that overlap",
        "[...document.querySelectorAll('svg')].flatMap(svg => {
            const all = [...svg.querySelectorAll('text')].map(text => [text.textContent.trim(), text.getBoundingClientRect()]);
            const meet = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
            return all.flatMap(([one, a], i) => all.slice(i + 1).filter(([other, b]) => meet(a, b)).map(([other]) => `${one} ${other}`));
        })",
    );
}

#[test]
fn a_mark_of_a_plot_tells_its_value() {
    let Some((browser, _folder)) = open(800, true) else { return };
    browser.assert_none(
        "plots without marks that tell, or marks that tell nothing",
        "['trade-nave', 'scaling', 'extremes', '6.2.14', 'finding-error']
            .map(id => document.getElementById(`figure-${id}`))
            .filter(figure => {
                const titles = [...figure.querySelectorAll('svg .spot > title')];
                return titles.length < 8 || !titles.every(title => /\\d/.test(title.textContent));
            })
            .map(figure => figure.id)",
    );
    browser.point("#figure-extremes .spot", 0.5, false);
    browser.until("!document.querySelector('.told').hidden");
    let [told, title] = [".told", "#figure-extremes .spot title"]
        .map(|selector| browser.value(&format!("document.querySelector('{selector}').textContent")));
    assert_eq!(told, title);
    browser.assert_quiet();
}

#[test]
fn a_refusal_stands_across_its_row_and_numbers_do_not_wrap() {
    let Some((browser, _folder)) = open(400, false) else { return };
    browser.assert_none(
        "rows that end before their table does",
        "[...document.querySelectorAll('table')].flatMap(table => {
            const columns = table.tHead.rows[0].cells.length;
            const across = row => [...row.cells].reduce((sum, cell) => sum + cell.colSpan, 0);
            return [...table.tBodies[0].rows].filter(row => across(row) !== columns).map(row => row.innerText);
        })",
    );
    let refusals = "[...document.querySelectorAll('#figure-extremes td[colspan]')].filter(cell => cell.innerText.startsWith('refused'))";
    assert!(browser.value(&format!("{refusals}.length")).as_u64().unwrap() > 3);
    browser.assert_none(
        "cells of numbers on several lines",
        "[...document.querySelectorAll('table.figures td:not(.text)')].filter(cell => {
            const range = document.createRange();
            range.selectNodeContents(cell);
            return new Set([...range.getClientRects()].map(box => Math.round(box.top))).size > 1;
        }).map(cell => cell.innerText)",
    );
}

#[test]
fn equations_are_drawn_by_the_browser_itself() {
    let Some((browser, _folder)) = open(800, false) else { return };
    assert!(browser.value("document.querySelectorAll('math').length").as_u64().unwrap() >= 13);
    browser.assert_none(
        "equations that are not drawn",
        "[...document.querySelectorAll('math')].filter(math => {
            const box = math.getBoundingClientRect();
            return box.width < 80 || box.height < 15 || math.querySelector('merror');
        }).map(math => math.textContent)",
    );
}

#[test]
fn on_paper_all_is_there_but_the_navigation_and_no_figure_is_torn() {
    let Some((browser, _folder)) = open(800, true) else { return };
    browser.emulate("print", "dark");
    browser.assert_none(
        "what only a window needs",
        "[...document.querySelectorAll('nav, .compare')].filter(part => part.getBoundingClientRect().height > 0)
            .map(part => part.className)",
    );
    browser.assert_none(
        "figures that may be torn",
        "[...document.querySelectorAll('figure')].filter(figure => getComputedStyle(figure).breakInside !== 'avoid')
            .map(figure => figure.id)",
    );
    assert_eq!(browser.value("getComputedStyle(document.body).backgroundColor"), "rgb(255, 255, 255)");
    assert_eq!(browser.value("document.querySelector('.missing ul').getBoundingClientRect().height > 20"), true);
    browser.emulate("", "light");
    // A PDF begins with %PDF.
    assert!(browser.print().starts_with("JVBER"));
    browser.assert_quiet();
}

#[test]
fn the_summary_answers_what_readers_ask_first() {
    let page = made().page();
    let summary = page.split("id=\"figures\"").next().unwrap();
    let answers = [
        ("finding-normals", "Do 8-bit normals suffice?", "/255"),
        ("finding-half-resolution", "What does half resolution cost?", "times (nave)"),
        ("finding-two-papers", "Where do the two papers disagree?", "a factor of 1.83"),
        ("finding-error", "Where does the error come from?", ": model "),
    ];
    for (id, question, part) in answers {
        let finding = summary.split(&format!("id=\"figure-{id}\"")).nth(1).unwrap_or_else(|| panic!("{id} is missing"));
        let finding = finding.split("</section>").next().unwrap();
        assert!(finding.contains(question), "{id}");
        let answer = finding.split("<p class=\"answer\">").nth(1).unwrap().split("</p>").next().unwrap();
        assert!(answer.contains(part), "{id}: {answer}");
        assert!(finding.contains("<img") || finding.contains("<svg"), "{id} has no picture");
        assert!(finding.contains("href=\"#claim-"), "{id} names no claim");
        assert!(page.contains(&format!("<a href=\"#figure-{id}\"")), "the contents lack {id}");
    }
    let about = summary.split("<dl class=\"about\">").nth(1).unwrap().split("</dl>").next().unwrap();
    for name in ["scenes", "machine", "renderer", "OpenGL", "size"] {
        assert!(about.contains(&format!("<dt>{name}</dt>")), "{about}");
    }
}
