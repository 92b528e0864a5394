//! `taut fit --compare`: friction laws and windows by what they predict.

use super::{is_held_back, led, status, table};
use crate::args::Fit as Args;
use crate::command::{Finished, Report};
use crate::failure::Outcome;
use crate::folder::{self, Folder};
use crate::interrupt::{Interrupt, interrupted};
use crate::progress::Progress;
use crate::terminal::bold;
use std::fmt::Write;
use std::time::Instant;
use taut::case::{Case, Plan};
use taut::fit::compare::{Comparison, ComparisonOptions, FrictionLaw, compare};
use taut::json;
use taut::solve::Flow;
use taut::{Error, Result};
use taut_report::fit::compare::{HEADINGS, rows, section};
use taut_report::fit::{FitResults, page_with};

/// Compares, fits with the best, writes, tells.
pub fn run(args: &Args, case: &Case, plan: &Plan) -> Outcome {
    let common = &args.common;
    let setting = setting(args, case, plan)?;
    let report = (!common.no_report).then_some("report.html");
    let names = ["fitted.toml", "compare.json", "fit.json"].into_iter().chain(report);
    let folder = Folder::wanted(common, || folder::inputs(&args.case, &case.files), names)?;
    let interrupt = Interrupt::listen();
    let is_stopped = || interrupt.signal().is_some();
    let begin = Instant::now();
    let progress = Progress::new("comparing laws of friction", None, common.quiet);
    let found = compare(case, &args.case, plan, &setting, Some(&is_stopped), &mut |name| {
        progress.tell(|| name.to_string());
        if is_stopped() { Flow::Stop } else { Flow::Continue }
    });
    progress.clear();
    let compared = match (found, interrupt.signal()) {
        (Err(_), Some(signal)) => {
            return Err(interrupted(signal, "interrupted before all laws were fitted; nothing was written"));
        }
        (found, _) => found?,
    };
    let found = FitResults { fit: compared.fit.clone(), profiles: Vec::new(), drawn: None };
    let json = json::comparison(&compared);
    let own = &compared.case;
    let text = format!("{}{}", shown(&compared), table::text(own, &found, begin.elapsed()));
    let advice = match common.out.is_some() {
        true => "there are warnings; --anyway writes it nevertheless",
        false => "add --out DIR for fitted.toml, compare.json, fit.json and a report",
    };
    let folder = folder.filter(|_| !is_held_back(&found.fit, args));
    let mut finished = Finished::new("fit", ("compare.json", json::text(&json)), text, advice);
    if let Some(folder) = &folder {
        let text = led(&found.fit.case_text(own, &args.case)?, args, folder)?;
        if common.draws() {
            let page = page_with(own, &found, &text, |page| section(page, &compared));
            finished.report = Some(Report { page, pictures: Vec::new() });
        }
        finished.files.push(("fitted.toml".into(), text));
        finished.files.push(("fit.json".into(), json::text(&json::fit(own, &found.fit, &[], None))));
    }
    finished.status = status(&found, &interrupt);
    finished.finish(common, folder)
}

/// The laws and windows that are asked for.
fn setting(args: &Args, case: &Case, plan: &Plan) -> Result<ComparisonOptions> {
    let mut setting = ComparisonOptions::usual(case, plan);
    if !args.laws.is_empty() {
        let laws = args.laws.iter().map(|name| FrictionLaw::named(name).map_err(|error| error.in_file("--laws")));
        setting.laws = laws.collect::<Result<_>>()?;
    }
    if !args.windows.is_empty() {
        setting.windows = args.windows.iter().map(|text| window(text)).collect::<Result<_>>()?;
    }
    Ok(setting)
}

/// The length of a window, s; none for whole logs.
fn window(text: &str) -> Result<Option<f64>> {
    if text == "whole" {
        return Ok(None);
    }
    let allowed = || {
        Error::new(format!("\"{text}\" is not a length of windows"))
            .in_file("--windows")
            .allowed("whole, or a time above zero such as 2s")
    };
    match taut::quantity::read(text, "s") {
        Ok(length) if length > 0.0 && length.is_finite() => Ok(Some(length)),
        _ => Err(allowed()),
    }
}

fn shown(compared: &Comparison) -> String {
    let mut text =
        format!("{}\n", bold(&format!("Friction of the {} by what it predicts", compared.body.replace('_', " "))));
    let _ = writeln!(text, "  held out: {}", compared.held_out);
    let rows: Vec<[String; 5]> = std::iter::once(HEADINGS.map(str::to_lowercase)).chain(rows(compared)).collect();
    let wide: [usize; 5] = std::array::from_fn(|k| rows.iter().map(|row| row[k].chars().count()).max().unwrap_or(0));
    for (k, [name, parameters, held_out, training, rank]) in rows.iter().enumerate() {
        let mark = if k == compared.chosen + 1 { "*" } else { " " };
        let _ = writeln!(
            text,
            " {mark} {name:<0$}  {parameters:>1$}  {held_out:>2$}  {training:>3$}  {rank:>4$}",
            wide[0], wide[1], wide[2], wide[3], wide[4]
        );
    }
    for candidate in &compared.candidates {
        if let Some(why) = &candidate.failed {
            let _ = writeln!(text, "  {}: {why}", candidate.name());
        }
    }
    for line in compared.words() {
        let _ = writeln!(text, "  {line}");
    }
    text.push('\n');
    text
}
