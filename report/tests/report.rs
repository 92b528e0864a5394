//! The report as its reader gets it: well-formed, self-contained, escaped, the same every time.

use resvg::tiny_skia::Pixmap;
use resvg::usvg::roxmltree::{Document, ParsingOptions};
use taut::friction::Friction;
use taut::stage::*;
use taut_report::diagram::Sign;
use taut_report::*;

const NASTY: &str = "<script>alert(\"1\")</script> & 'two' \u{0}\u{1b}]]>";

fn stage(encoder: Option<Encoder>) -> Stage {
    let pulley = Pulley { inertia: 6.3e-5, friction: Friction::with_breakaway(0.0016, 0.015, 0.02) };
    Stage {
        motor: Motor {
            torque_constant: 0.023,
            back_emf_constant: 0.023,
            resistance: 0.71,
            inductance: 1e-3,
            rotor_inertia: 1e-6,
            gear_ratio: 5.9,
            gear_efficiency: 0.8,
            gear_play: None,
        },
        amplifier: Amplifier::ideal(AmplifierMode::Voltage, 2.0),
        pulley_radius: 0.0194,
        drive_pulley: pulley,
        cart: Cart::new(0.362, Friction::symmetric(19.0424, 0.2)),
        idler_pulley: pulley,
        belt: Belt::given([132.76e3, 132.76e3, f64::NAN], [0.0, 3.0, 0.0]),
        travel: None,
        encoder,
    }
}

fn body(name: &str, terms: usize) -> BodyEquation {
    let term = |i: usize| Term {
        input: format!("x_{i} {NASTY}"),
        gain: "r² k₁".into(),
        value: i as f64,
        unit: "N m/rad".into(),
        sign: if i.is_multiple_of(2) { Sign::Plus } else { Sign::Minus },
    };
    BodyEquation {
        name: name.into(),
        acceleration: "φ̈₁".into(),
        speed: "φ̇₁".into(),
        position: "φ₁".into(),
        inertia: Inertia { symbol: "J₁".into(), value: 6.3e-5, unit: "kg m^2".into() },
        terms: (0..terms).map(term).collect(),
        friction: FrictionTerm { symbol: "τ_f1".into(), parameters: vec!["B₁ = 1.6 mN m s".into(), NASTY.into()] },
    }
}

/// Every kind of curve, also those that cannot be drawn.
fn figures() -> Vec<Figure> {
    let t: Vec<f64> = (0..3000).map(|i| f64::from(i) * 1e-3).collect();
    let y: Vec<f64> = t.iter().map(|t| 0.05 * (9.0 * t).sin()).collect();
    let gaps: Vec<f64> = y.iter().enumerate().map(|(i, y)| if i % 100 < 7 { f64::NAN } else { *y }).collect();
    let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN, 0.0, -0.0, 5e-324];
    let panel = |x: &[f64], y: &[f64], style| {
        Panel::new(Axis::new(NASTY, "m").shown_as("mm", 1e3))
            .series(Series::new(NASTY, x, y).style(style))
            .horizontal(0.03, NASTY)
            .horizontal(f64::NAN, "nowhere")
    };
    let mut all = vec![Figure::new("", Axis::new("", ""))];
    for style in [Style::Solid, Style::Dashed, Style::Dotted, Style::Points] {
        for (x, y) in [(&t[..], &y[..]), (&t, &gaps), (&[], &[]), (&[1.0], &[2.0]), (&odd, &odd), (&t[..5], &y[..2])] {
            let figure = Figure::new(NASTY, Axis::new("Time", "s")).caption(NASTY);
            all.push(figure.panel(panel(x, y, style)).panel(panel(y, x, style)).vertical(0.25, NASTY));
        }
        let log = Figure::new("log", Axis::new("Frequency", "Hz").logarithmic());
        all.push(log.panel(Panel::new(Axis::new("Gain", "").logarithmic()).line("G", &t, &y).weight(f64::NAN)));
    }
    all
}

fn page() -> Page {
    let mut page = Page::new(NASTY).subtitle(NASTY);
    for _ in 0..4 {
        page.section(NASTY);
    }
    page.subsection(NASTY);
    page.prose(NASTY);
    page.definitions([(NASTY, NASTY)]);
    page.callout(Callout::Fails, NASTY, NASTY);
    let mut table = Table::new(NASTY).column(NASTY, "kg m^2").column("n", "");
    table.row([NASTY.into(), Cell::number(-1.5e-7, 3)]);
    table.row([Callout::Holds.into(), Cell::fixed(f64::NAN, 3)]);
    page.table(&table);
    page.equation(maud::html! { math { mi { "φ" } mo { "=" } mn { "0" } } }, Some("(1)"));
    page.embed(NASTY, NASTY);
    figures().iter().for_each(|f| page.figure(f));
    page.drawing(&stage_drawing(&stage(None)), NASTY);
    page.footer(NASTY);
    page
}

fn well_formed(svg: &str) {
    let options = ParsingOptions { allow_dtd: false, ..ParsingOptions::default() };
    let document = Document::parse_with_options(svg, options).unwrap_or_else(|e| panic!("{e}\n{svg}"));
    assert_eq!(document.root_element().tag_name().name(), "svg");
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    assert!(document.descendants().all(|n| n.tag_name().name() != "script"));
}

#[test]
fn every_picture_is_well_formed_and_can_be_rasterised() {
    let mut pictures: Vec<String> = figures().iter().map(Figure::svg).collect();
    for at in [EncoderPlace::Motor, EncoderPlace::DrivePulley, EncoderPlace::Cart] {
        pictures.push(stage_drawing(&stage(Some(Encoder { at, lines: 512.0 }))));
    }
    let bodies = [0, 1, 4].map(|n| body("Cart", n));
    pictures.extend(bodies.iter().map(body_diagram));
    let motor =
        MotorEquation {
            input: "u".into(), torque: "τ_M".into(), lines: vec![NASTY.into()], feedback: "φ̇₁".into()
        };
    pictures.push(axis_diagram(&motor, bodies.each_ref()));
    for svg in &pictures {
        well_formed(svg);
        assert!(png(svg, 0.5).unwrap().starts_with(b"\x89PNG"));
    }
}

#[test]
fn a_png_has_the_size_of_its_svg() {
    let svg = figures()[1].svg();
    let document = Document::parse(&svg).unwrap();
    let side = |name| document.root_element().attribute(name).unwrap().parse::<f64>().unwrap();
    for scale in [1.0, 2.0] {
        let picture = Pixmap::decode_png(&png(&svg, scale).unwrap()).unwrap();
        assert_eq!(f64::from(picture.width()), (side("width") * f64::from(scale)).ceil());
        assert_eq!(f64::from(picture.height()), (side("height") * f64::from(scale)).ceil());
    }
    assert!(png(&svg, 1e6).is_err() && png(&svg, f32::NAN).is_err() && png("<svg", 1.0).is_err());
}

#[test]
fn text_is_drawn_with_the_font_that_comes_along() {
    let with = |text: &str| {
        let figure = Figure::new(text, Axis::new("", "")).panel(Panel::new(Axis::new("", "")));
        Pixmap::decode_png(&png(&figure.svg(), 1.0).unwrap()).unwrap().data().iter().filter(|b| **b < 128).count()
    };
    assert!(with("Drive pulley") > with("") + 100);
}

#[test]
fn the_page_asks_for_nothing_and_runs_nothing_foreign() {
    let html = page().html();
    let without = html.replace("http://www.w3.org/2000/svg", "").replace("http://www.w3.org/1998/Math/MathML", "");
    for word in ["http:", "https:", "src=", "@import", "url(", "<link", "alert(\"1\")", "<script>alert"] {
        assert!(!without.contains(word), "{word}");
    }
    // One script, however many plots; all other script elements are data.
    assert_eq!(html.matches("<script>").count(), 1);
    let data: Vec<&str> = html.split("<script type=\"application/json\">").skip(1).collect();
    assert_eq!(data.len(), figures().len());
    for json in data {
        let json = json.split("</script>").next().unwrap();
        assert!(json.starts_with('{') && json.ends_with('}') && !json.contains(['<', '\0']));
        assert!(!json.contains("NaN") && !json.contains("inf"), "{json}");
    }
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    assert_eq!(page().html(), page().html());
    let figure = &figures()[1];
    assert_eq!(figure.svg(), figure.svg());
    assert_eq!(png(&figure.svg(), 1.0).unwrap(), png(&figure.svg(), 1.0).unwrap());
}

#[test]
fn twenty_plots_of_two_thousand_points_stay_small() {
    let t: Vec<f64> = (0..2000).map(|i| f64::from(i) * 1e-3).collect();
    let mut page = Page::new("Twenty");
    for i in 0..20 {
        let y: Vec<f64> = t.iter().map(|t| (f64::from(i) + 9.0 * t).sin()).collect();
        page.figure(&Figure::new("", Axis::new("Time", "s")).panel(Panel::new(Axis::new("", "m")).line("y", &t, &y)));
    }
    assert!(page.html().len() < 500_000, "{}", page.html().len());
}
