//! A small interpreter of Structured Text: function blocks of LREAL and BOOL variables, assignments, IF, arithmetic,
//! comparisons, TRUNC and DINT_TO_LREAL.

use std::collections::HashMap;

/// A word of the text.
#[derive(Debug, Clone, PartialEq)]
enum Token {
    Word(String),
    Number(f64),
    Sign(&'static str),
}

const SIGNS: [&str; 14] = [":=", "<=", ">=", "<>", "<", ">", "=", "+", "-", "*", "/", "(", ")", ";"];

fn tokens(text: &str) -> Vec<Token> {
    let mut all = Vec::new();
    let mut rest = text;
    loop {
        rest = rest.trim_start();
        if let Some(comment) = rest.strip_prefix("(*") {
            rest = comment.split_once("*)").expect("a comment ends").1;
            continue;
        }
        let Some(first) = rest.chars().next() else { return all };
        if first.is_ascii_alphabetic() {
            let end = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(rest.len());
            all.push(Token::Word(rest[..end].to_ascii_uppercase()));
            rest = &rest[end..];
        } else if first.is_ascii_digit() {
            let is_part = |k: usize, c: char| {
                let after_e = k > 0 && rest[..k].ends_with('E');
                c.is_ascii_digit() || c == '.' || c == 'E' || (after_e && (c == '-' || c == '+'))
            };
            let end = rest.char_indices().find(|(k, c)| !is_part(*k, *c)).map_or(rest.len(), |(k, _)| k);
            assert!(rest[..end].contains('.'), "a REAL literal has a point: {}", &rest[..end]);
            all.push(Token::Number(rest[..end].parse().unwrap()));
            rest = &rest[end..];
        } else if first == ':' && !rest.starts_with(":=") {
            all.push(Token::Sign(":"));
            rest = &rest[1..];
        } else {
            let sign = SIGNS.iter().find(|sign| rest.starts_with(**sign));
            let sign = sign.unwrap_or_else(|| panic!("what is this: {}", &rest[..rest.len().min(40)]));
            all.push(Token::Sign(sign));
            rest = &rest[sign.len()..];
        }
    }
}

/// A function block with its variables.
pub struct Block {
    pub name: String,
    values: HashMap<String, f64>,
    body: Vec<Token>,
}

impl Block {
    /// Reads one.
    pub fn new(text: &str) -> Self {
        let all = tokens(text);
        let word = |k: usize| match &all[k] {
            Token::Word(word) => word.clone(),
            other => panic!("a word is wanted: {other:?}"),
        };
        assert_eq!(word(0), "FUNCTION_BLOCK");
        let (name, mut k, mut values) = (word(1), 2, HashMap::new());
        while matches!(&all[k], Token::Word(word) if word.starts_with("VAR")) {
            k += 1;
            while all[k] != Token::Word("END_VAR".into()) {
                let variable = word(k);
                assert_eq!(all[k + 1], Token::Sign(":"));
                assert!(matches!(word(k + 2).as_str(), "LREAL" | "BOOL"));
                k += 3;
                let mut start = 0.0;
                if all[k] == Token::Sign(":=") {
                    let Token::Number(value) = all[k + 1] else { panic!("a number is wanted") };
                    (start, k) = (value, k + 2);
                }
                assert_eq!(all[k], Token::Sign(";"));
                k += 1;
                assert!(values.insert(variable, start).is_none(), "a variable twice");
            }
            k += 1;
        }
        let end = all.iter().position(|token| *token == Token::Word("END_FUNCTION_BLOCK".into())).unwrap();
        assert_eq!(end + 1, all.len());
        Self { name, values, body: all[k..end].to_vec() }
    }

    /// True if there is a variable of this name.
    pub fn has(&self, name: &str) -> bool {
        self.values.contains_key(&name.to_ascii_uppercase())
    }

    pub fn set(&mut self, name: &str, value: f64) {
        *self.values.get_mut(&name.to_ascii_uppercase()).unwrap() = value;
    }

    pub fn get(&self, name: &str) -> f64 {
        self.values[&name.to_ascii_uppercase()]
    }

    /// One call.
    pub fn call(&mut self) {
        let body = std::mem::take(&mut self.body);
        let mut at = 0;
        self.statements(&body, &mut at, true);
        assert_eq!(at, body.len());
        self.body = body;
    }

    /// Statements up to END_IF, ELSE or the end, done or passed over.
    fn statements(&mut self, body: &[Token], at: &mut usize, does: bool) {
        while let Some(token) = body.get(*at) {
            match token {
                Token::Sign(";") => *at += 1,
                Token::Word(word) if word == "IF" => {
                    *at += 1;
                    let test = self.sum_or_test(body, at) != 0.0;
                    expect(body, at, &Token::Word("THEN".into()));
                    self.statements(body, at, does && test);
                    if body[*at] == Token::Word("ELSE".into()) {
                        *at += 1;
                        self.statements(body, at, does && !test);
                    }
                    expect(body, at, &Token::Word("END_IF".into()));
                    expect(body, at, &Token::Sign(";"));
                }
                Token::Word(word) if word == "ELSE" || word == "END_IF" => return,
                Token::Word(name) => {
                    *at += 1;
                    expect(body, at, &Token::Sign(":="));
                    let value = self.sum_or_test(body, at);
                    expect(body, at, &Token::Sign(";"));
                    let place = self.values.get_mut(name).unwrap_or_else(|| panic!("{name} is not declared"));
                    if does {
                        *place = value;
                    }
                }
                other => panic!("no statement begins with {other:?}"),
            }
        }
    }

    fn sum_or_test(&self, body: &[Token], at: &mut usize) -> f64 {
        let left = self.sum(body, at);
        let Token::Sign(sign @ ("<" | ">" | "<=" | ">=" | "=" | "<>")) = body[*at] else { return left };
        *at += 1;
        let right = self.sum(body, at);
        f64::from(u8::from(match sign {
            "<" => left < right,
            ">" => left > right,
            "<=" => left <= right,
            ">=" => left >= right,
            "=" => left == right,
            _ => left != right,
        }))
    }

    fn sum(&self, body: &[Token], at: &mut usize) -> f64 {
        let mut sum = self.product(body, at);
        while let Some(Token::Sign(sign @ ("+" | "-"))) = body.get(*at) {
            *at += 1;
            let other = self.product(body, at);
            sum = if *sign == "+" { sum + other } else { sum - other };
        }
        sum
    }

    fn product(&self, body: &[Token], at: &mut usize) -> f64 {
        let mut product = self.factor(body, at);
        while let Some(Token::Sign(sign @ ("*" | "/"))) = body.get(*at) {
            *at += 1;
            let other = self.factor(body, at);
            product = if *sign == "*" { product * other } else { product / other };
        }
        product
    }

    fn factor(&self, body: &[Token], at: &mut usize) -> f64 {
        let token = &body[*at];
        *at += 1;
        match token {
            Token::Number(value) => *value,
            Token::Sign("-") => -self.factor(body, at),
            Token::Sign("(") => {
                let value = self.sum_or_test(body, at);
                expect(body, at, &Token::Sign(")"));
                value
            }
            Token::Word(word) if word == "NOT" => f64::from(u8::from(self.factor(body, at) == 0.0)),
            Token::Word(word) if word == "TRUNC" => self.factor(body, at).trunc(),
            Token::Word(word) if word == "DINT_TO_LREAL" => self.factor(body, at),
            Token::Word(name) => *self.values.get(name).unwrap_or_else(|| panic!("{name} is not declared")),
            other => panic!("no expression begins with {other:?}"),
        }
    }
}

fn expect(body: &[Token], at: &mut usize, token: &Token) {
    assert_eq!(&body[*at], token, "word {at}");
    *at += 1;
}

#[test]
fn it_computes_as_the_standard_says() {
    let mut block = Block::new(
        "FUNCTION_BLOCK x VAR_INPUT a : LREAL; END_VAR VAR b : LREAL := 2.0; c : LREAL; END_VAR
         c := (a - 1.0) - b * 3.0; (* precedence *) IF NOT (c > -1.0E1) THEN c := DINT_TO_LREAL(TRUNC(c / 2.0));
         ELSE IF c < 0.0 THEN c := -c; END_IF; END_IF; END_FUNCTION_BLOCK",
    );
    for (a, c) in [(4.0, 3.0), (9.0, 2.0), (-8.5, -7.0)] {
        block.set("a", a);
        block.call();
        assert_eq!(block.get("C"), c);
    }
}
