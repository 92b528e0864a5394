//! The report as its reader gets it: well-formed, self-contained, escaped, the same every time.

use resvg::tiny_skia::Pixmap;
use resvg::usvg::roxmltree::{Document, ParsingOptions};
use taut::friction::Friction;
use taut::machine::*;
use taut_report::diagram::Sign;
use taut_report::*;

const NASTY: &str = "<script>alert(\"1\")</script> & 'two' \u{0}\u{1b}]]>";

fn machine(encoder: Option<Encoder>) -> Machine {
    let pulley = Pulley { inertia: 6.3e-5, friction: Friction::with_breakaway(0.0016, 0.015, 0.02) };
    Machine {
        kind: MachineKind::Axis,
        drives: vec![DriveUnit {
            motor: Motor {
                torque_constant: 0.023,
                back_emf_constant: 0.023,
                resistance: 0.71,
                inductance: 1e-3,
                rotor_inertia: 1e-6,
                gear_ratio: 5.9,
                gear_efficiency: 0.8,
                gear_play: None,
                is_simple: false,
                stepper: None,
            },
            amplifier: Amplifier::ideal(AmplifierMode::Voltage, 2.0),
        }],
        bridge: None,
        yaw: None,
        pulley_radius: 0.0194,
        drive_pulley: pulley,
        cart: Slide::new(0.362, Friction::symmetric(19.0424, 0.2)),
        idler_pulley: pulley,
        belt: Belt::given([132.76e3, 132.76e3, f64::NAN], [0.0, 3.0, 0.0]),
        encoder,
        scale: None,
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
    for style in [Style::Solid, Style::Dashed, Style::Dotted, Style::Points, Style::Crosses, Style::Rings] {
        for (x, y) in [(&t[..], &y[..]), (&t, &gaps), (&[], &[]), (&[1.0], &[2.0]), (&odd, &odd), (&t[..5], &y[..2])] {
            let figure = Figure::new(NASTY, Axis::new("Time", "s")).caption(NASTY);
            all.push(figure.clone().panel(panel(y, x, style)).equal().vertical(0.25, NASTY));
            let two = figure.panel(panel(x, y, style)).panel(panel(y, x, style)).vertical(0.25, NASTY);
            all.extend([two.clone().view(0.2, 0.4), two.clone().view(-1.0, f64::INFINITY), two]);
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
    page.drawing(&machine_drawing(&machine(None)), NASTY);
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
        pictures.push(machine_drawing(&machine(Some(Encoder { at, lines: 512.0 }))));
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

/// A stage with an encoder at the motor and a scale at the cart was drawn with the encoder alone.
#[test]
fn a_scale_beside_an_encoder_is_drawn() {
    let encoder = Encoder { at: EncoderPlace::Motor, lines: 512.0 };
    let alone = machine(Some(encoder));
    let scale = Some(Encoder { at: EncoderPlace::Cart, lines: 50e3 });
    let [without, with] = [alone.clone(), Machine { scale, ..alone }].map(|machine| machine_drawing(&machine));
    well_formed(&with);
    assert!(with.contains("encoder, 512 lines") && with.contains("scale, 50000 lines/m"), "{with}");
    assert!(without.contains("encoder, 512 lines") && !without.contains("lines/m"));
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

/// A name that both modules declared would keep every figure of every report from coming to life.
#[test]
fn the_modules_of_the_script_declare_each_name_once() {
    let texts = page::MODULES.map(|(_, text)| text).into_iter().chain([include_str!("../src/live.js")]);
    let lines = texts.flat_map(str::lines).map(|line| line.strip_prefix("export ").unwrap_or(line));
    let declared =
        |line: &'static str| ["const ", "let ", "function ", "class "].iter().find_map(|word| line.strip_prefix(word));
    let name = |rest: &'static str| rest.split(|c: char| !c.is_alphanumeric()).next();
    let mut names: Vec<&str> = lines.filter_map(declared).filter_map(name).collect();
    names.sort_unstable();
    assert!(names.len() > 30, "{names:?}");
    assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{names:?}");
    for line in page::script(true).lines().skip(1) {
        let starts = ["export ", "import ", "//", "*", "/**", " "].iter().any(|start| line.starts_with(start));
        assert!(!line.is_empty() && !starts, "{line}");
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

/// The values of the attribute `name` of the elements `tag`.
fn attributes(svg: &str, tag: &str, name: &str) -> Vec<String> {
    let document = Document::parse(svg).unwrap();
    let found = document.descendants().filter(|n| n.tag_name().name() == tag);
    found.filter_map(|n| n.attribute(name).map(str::to_string)).collect()
}

/// Nyquist's curve had axes of different units, and the circle around −1 was an ellipse.
#[test]
fn a_circle_is_round_where_axes_are_equal() {
    let angle = |k: i32| f64::from(k) * std::f64::consts::TAU / 360.0;
    let (x, y): (Vec<f64>, Vec<f64>) = (0..=360).map(|k| (angle(k).cos(), angle(k).sin())).unzip();
    let circle = Figure::new("", Axis::new("Re", "")).panel(Panel::new(Axis::new("Im", "")).line("", &x, &y));
    let sides = |figure: &Figure| {
        let path = attributes(&figure.svg(), "path", "d").into_iter().max_by_key(String::len).unwrap();
        let numbers: Vec<f64> = path.split(['M', 'L', ' ']).filter_map(|word| word.parse().ok()).collect();
        let side = |k: usize| {
            let values = || numbers.iter().skip(k).step_by(2).copied();
            values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min)
        };
        side(0) / side(1)
    };
    assert!(sides(&circle) > 2.0, "{}", sides(&circle));
    assert!((sides(&circle.clone().equal()) - 1.0).abs() < 0.005, "{}", sides(&circle.equal()));
}

/// Sensitivity was shown from 10 µHz, and its peak stood in a few pixels at the right.
#[test]
fn what_is_shown_first_can_be_a_part() {
    let x: Vec<f64> = (0..=1000).map(|k| 10f64.powf(-5.0 + 8.0 * f64::from(k) / 1000.0)).collect();
    let y: Vec<f64> = x.iter().map(|x| if *x < 1.0 { 1e6 } else { 1.0 + 1.0 / x }).collect();
    let axis = || Axis::new("Frequency", "Hz").logarithmic();
    let figure = Figure::new("", axis()).panel(Panel::new(Axis::new("|S|", "")).line("", &x, &y)).view(1.0, 1e3);
    let texts = figure.svg();
    assert!(texts.contains(">1000<") && !texts.contains(">0.01<") && !texts.contains("10⁶"), "{texts}");
    let mut page = Page::new("");
    page.figure(&figure);
    assert!(page.html().contains("\"range\":[1e0,1e3]"));
    // All of the curve is there for who zooms out.
    assert!(page.html().contains("\"n\":1001"));
}

/// "10000" at the end of a frequency axis was cut at the edge of the picture.
#[test]
fn the_last_tick_is_not_cut() {
    let (x, y) = ([10.0, 10_000.0], [0.0, 1.0]);
    let figure = Figure::new("", Axis::new("Frequency", "Hz").logarithmic());
    let svg = figure.panel(Panel::new(Axis::new("Gain", "")).line("", &x, &y)).svg();
    let document = Document::parse(&svg).unwrap();
    let last = document.descendants().find(|n| n.text() == Some("10000")).unwrap();
    let text = last.ancestors().find(|n| n.tag_name().name() == "text").unwrap();
    let middle: f64 = text.attribute("x").unwrap().parse().unwrap();
    assert_eq!(text.attribute("text-anchor"), Some("middle"));
    assert!(middle + 18.0 <= 760.0, "{middle}");
}

#[test]
fn figures_over_the_same_axis_are_zoomed_together() {
    let figure = |label: &str, to: f64| {
        Figure::new("", Axis::new(label, "s")).panel(Panel::new(Axis::new("", "")).line("", &[0.0, to], &[0.0, 1.0]))
    };
    let mut page = Page::new("");
    for figure in
        [figure("Time", 1.0), figure("Lag", 1.0), figure("Time", 1.1), figure("Time", 9.0), figure("Time", 1.0).equal()]
    {
        page.figure(&figure);
    }
    let html = page.html();
    let axes: Vec<&str> =
        html.split("<figure class=\"plot\"").skip(1).map(|rest| rest.split('>').next().unwrap()).collect();
    assert_eq!(axes, [" data-axis=\"0\"", " data-axis=\"1\"", " data-axis=\"0\"", " data-axis=\"2\"", ""]);
}

/// Sections were not finer when zoomed: every curve of more than 1500 rows had been thinned out.
#[test]
fn evenly_spaced_samples_are_embedded_whole_and_thinning_is_said() {
    let json = |rows: u32| {
        let t: Vec<f64> = (0..rows).map(|i| f64::from(i) * 1e-3).collect();
        let y: Vec<f64> = t.iter().map(|t| (99.0 * t).sin()).collect();
        let mut page = Page::new("");
        page.figure(&Figure::new("", Axis::new("Time", "s")).panel(Panel::new(Axis::new("", "m")).line("y", &t, &y)));
        page.html()
    };
    let html = json(12_000);
    assert!(html.contains("\"n\":12000") && !html.contains("\"of\":"));
    let html = json(50_000);
    assert!(html.contains("\"of\":50000") && html.contains("\"n\":6000"));
    // A whole curve of twice the points weighs no more than a thinned one.
    assert!(json(12_000).len() <= html.len() + 100, "{} {}", json(12_000).len(), html.len());
}

#[test]
fn poles_are_crosses_and_zeros_are_circles() {
    let panel = Panel::new(Axis::new("Im", ""));
    let panel = panel.series(Series::new("poles", [1.0], [2.0]).style(Style::Crosses));
    let svg = Figure::new("", Axis::new("Re", ""))
        .panel(panel.series(Series::new("zeros", [2.0], [1.0]).style(Style::Rings)))
        .svg();
    // One in the legend, one in the plot.
    assert_eq!((svg.matches("l8 8").count(), svg.matches("a4 4").count()), (2, 4));
}
