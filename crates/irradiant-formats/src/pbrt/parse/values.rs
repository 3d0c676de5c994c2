//! Below the directives: tokens, and parameter lists with their values.

use super::super::legacy;
use super::super::lex::{Kind, Lexer, ListEnd, Token, parse_f32, parse_f64, parse_i32};
use super::super::params::{Param, Type, Values};
use super::{Abandoned, DIRECTIVES, Parser, Parsing};
use irradiant_scene::{Diagnostic, Span, Spanned};
use std::cell::Cell;

impl Parser<'_, '_> {
    // Tokens.

    pub(super) fn lexer(&mut self) -> &mut Lexer {
        // `run` calls directives only while there is a frame.
        let last = self.frames.len() - 1;
        &mut self.frames[last].lexer
    }

    pub(super) fn span(&mut self, token: Token) -> Span {
        self.lexer().span(token)
    }

    /// True for a word with which a statement begins: whatever was expected here is missing.
    pub(super) fn begins_statement(&mut self, token: Token) -> bool {
        token.kind == Kind::Word && {
            let word = self.lexer().bytes(token);
            DIRECTIVES.iter().any(|d| d.as_bytes() == word) || legacy::directive(word).is_some()
        }
    }

    /// True for a string like `"float radius"`.
    fn declares_parameter(&mut self, token: Token) -> bool {
        if token.kind != Kind::Text {
            return false;
        }
        let text = String::from_utf8_lossy(self.lexer().bytes(token)).into_owned();
        let mut words = text.trim_matches('"').split_ascii_whitespace();
        let kind = words.next().is_some_and(|w| Type::NAMES.iter().any(|(n, _)| *n == w));
        kind && words.next().is_some() && words.next().is_none()
    }

    /// True for a declaration that its value follows: a string where a name or a value is expected is not that string then.
    fn is_parameter(&mut self, token: Token) -> bool {
        self.declares_parameter(token) && {
            let mut ahead = self.lexer().clone();
            ahead.back_to(token);
            ahead.next();
            let value = ahead.next();
            match value.kind {
                Kind::Open => true,
                Kind::Word => !self.begins_statement(value),
                Kind::Text | Kind::Unterminated | Kind::Close | Kind::End => false,
            }
        }
    }

    pub(super) fn skip_to_directive(&mut self) {
        loop {
            let token = self.lexer().peek();
            if token.kind == Kind::End || self.begins_statement(token) {
                return;
            }
            self.lexer().next();
        }
    }

    /// Complains about a token that is not what had to come. A directive is not consumed: it stands where it should.
    pub(super) fn expected<T>(&mut self, code: &'static str, token: Token, what: &str) -> Parsing<T> {
        if self.begins_statement(token) {
            self.lexer().back_to(token);
        }
        let span = self.span(token);
        let shown = String::from_utf8_lossy(self.lexer().bytes(token)).chars().take(40).collect::<String>();
        match token.kind {
            Kind::End => self.r.error("E0005", format!("the file ends where {what} is expected"), span),
            Kind::Unterminated => {
                self.r.error_help("E0001", "this string has no end", span, "close it with \" on the same line");
            }
            _ => self.r.push(
                Diagnostic::error(code, format!("expected {what}, found {shown}"), span).label(format!("not {what}")),
            ),
        }
        Err(Abandoned)
    }

    pub(super) fn string(&mut self, what: &str) -> Parsing<Spanned<String>> {
        let token = self.lexer().next();
        if token.kind != Kind::Text || self.is_parameter(token) {
            return self.expected("E0003", token, what);
        }
        self.dequote(token)
    }

    pub(super) fn dequote(&mut self, token: Token) -> Parsing<Spanned<String>> {
        let span = self.span(token);
        match self.lexer().string(token) {
            Ok(text) => Ok(Spanned::new(text, span)),
            Err(place) => {
                let help = r#"known: \b \f \n \r \t \\ \' \""#;
                self.r.error_help("E0002", "unknown escape in a string", place, help);
                Err(Abandoned)
            }
        }
    }

    pub(super) fn number(&mut self) -> Parsing<f64> {
        let token = self.lexer().next();
        let value = match token.kind {
            Kind::Word => parse_f64(self.lexer().bytes(token)),
            _ => None,
        };
        match value {
            Some(v) => Ok(v),
            None => self.expected("E0004", token, "a number"),
        }
    }

    pub(super) fn numbers<const N: usize>(&mut self) -> Parsing<[f64; N]> {
        let mut out = [0.0; N];
        for v in &mut out {
            *v = self.number()?;
        }
        Ok(out)
    }

    /// Sixteen numbers in brackets, column-major as pbrt writes them.
    pub(super) fn matrix(&mut self) -> Parsing<[f64; 16]> {
        let open = self.lexer().next();
        if open.kind != Kind::Open {
            return self.expected("E0013", open, "[ and 16 numbers");
        }
        let m = self.numbers()?;
        let close = self.lexer().next();
        if close.kind != Kind::Close {
            return self.expected("E0013", close, "] after 16 numbers");
        }
        Ok(m)
    }

    // Parameter lists.

    pub(super) fn parameters(&mut self) -> Parsing<Vec<Param>> {
        let mut list = vec![];
        self.refused_parameter = false;
        loop {
            let token = self.lexer().peek();
            match token.kind {
                Kind::Text => {
                    self.lexer().next();
                    match self.parameter(token)? {
                        Some(p) => list.push(p),
                        None => self.refused_parameter = true,
                    }
                }
                Kind::Unterminated => {
                    self.lexer().next();
                    return self.expected("E0001", token, "a parameter");
                }
                _ => return Ok(list),
            }
        }
    }

    pub(super) fn parameter(&mut self, token: Token) -> Parsing<Option<Param>> {
        let declaration = self.dequote(token)?;
        let mut words = declaration.value.split_ascii_whitespace();
        let (Some(type_name), Some(name), None) = (words.next(), words.next(), words.next()) else {
            let message = format!("\"{}\" is not a parameter declaration", declaration.value);
            let help = "a type and a name in one string, as in \"float radius\"";
            self.r.error_help("E0008", message, declaration.span, help);
            return Err(Abandoned);
        };
        let kind = self.parameter_type(type_name, declaration.span);
        let first = self.lexer().peek();
        let values = self.values(kind.unwrap_or(Type::String), kind.is_some(), &declaration.value)?;
        let (Some(kind), Some((values, end))) = (kind, values) else { return Ok(None) };
        let value_span = Span { end: end as u32, ..self.span(first) };
        Ok(Some(Param {
            kind,
            name: name.into(),
            span: declaration.span,
            value_span,
            values,
            attribute: None,
            used: Cell::new(false),
        }))
    }

    pub(super) fn parameter_type(&mut self, name: &str, span: Span) -> Option<Type> {
        if let Some((_, t)) = Type::NAMES.iter().find(|(n, _)| *n == name) {
            return Some(*t);
        }
        let alias = match name {
            "point" => Some(Type::Point3),
            "vector" => Some(Type::Vector3),
            "normal3" => Some(Type::Normal),
            _ => None,
        };
        if let Some(t) = alias {
            let message = format!("parameter type \"{name}\" is read as \"{}\"", t.name());
            self.r.push(Diagnostic::new(irradiant_scene::Severity::Note, "N0114", message, span));
            return Some(t);
        }
        if let Some(help) = legacy::parameter_type(name) {
            self.r.v3("E1103", format!("parameter type \"{name}\" is pbrt-v3's"), span, help);
            return None;
        }
        let names: Vec<&str> = Type::NAMES.iter().map(|(n, _)| *n).collect();
        self.r.unknown("E0009", "parameter type", &Spanned::new(name.into(), span), &names);
        None
    }

    /// The values after a declaration, and where they end; `None` when they are of the wrong kind (reported, skipped).
    pub(super) fn values(&mut self, kind: Type, known: bool, declaration: &str) -> Parsing<Option<(Values, usize)>> {
        let first = self.lexer().next();
        let value = || format!("a value for \"{declaration}\"");
        match first.kind {
            Kind::Open if !known => {
                self.skip_list();
                Ok(None)
            }
            Kind::Open => self.bracketed(kind, first),
            Kind::Word if self.begins_statement(first) => self.expected("E0007", first, &value()),
            Kind::Text if self.is_parameter(first) => {
                // Reported; the next parameter can be read all the same.
                let _ = self.expected::<()>("E0007", first, &value());
                self.lexer().back_to(first);
                Ok(None)
            }
            Kind::Word | Kind::Text if !known => Ok(None),
            Kind::Word | Kind::Text => {
                let mut values = Self::empty(kind, first, self.lexer());
                let good = self.value(kind, first, &mut values)?;
                Ok(good.then_some((values, first.end)))
            }
            _ => self.expected("E0007", first, &value()),
        }
    }

    pub(super) fn empty(kind: Type, first: Token, _: &Lexer) -> Values {
        match kind {
            Type::Integer => Values::Integers(vec![]),
            Type::Bool => Values::Bools(vec![]),
            Type::String | Type::Texture => Values::Strings(vec![]),
            Type::Spectrum if first.kind == Kind::Text => Values::Strings(vec![]),
            _ => Values::Floats(vec![]),
        }
    }

    pub(super) fn bracketed(&mut self, kind: Type, open: Token) -> Parsing<Option<(Values, usize)>> {
        let first = self.lexer().peek();
        let mut values = Self::empty(kind, first, self.lexer());
        let mut good = true;
        loop {
            let end = match &mut values {
                Values::Floats(v) => self.lexer().floats(v),
                Values::Integers(v) => self.lexer().integers(v),
                _ => {
                    let token = self.lexer().next();
                    match token.kind {
                        Kind::Close => ListEnd::Closed,
                        Kind::End => ListEnd::End,
                        _ => ListEnd::Bad(token),
                    }
                }
            };
            match end {
                ListEnd::Closed => {
                    let place = self.lexer().here();
                    return Ok(good.then_some((values, place)));
                }
                ListEnd::Bad(token) if token.kind == Kind::Open => {
                    return self.expected("E0007", token, "a value or ]");
                }
                // What cannot be a value shows that the list should have ended before: it is read as what it is.
                ListEnd::Bad(token) if self.begins_statement(token) || self.is_parameter(token) => {
                    self.lexer().back_to(token);
                    self.endless_list(open);
                    return Ok(None);
                }
                ListEnd::End => {
                    self.endless_list(open);
                    return Err(Abandoned);
                }
                ListEnd::Bad(token) => good &= self.value(kind, token, &mut values)?,
            }
            if !good {
                self.skip_list();
                return Ok(None);
            }
        }
    }

    fn endless_list(&mut self, open: Token) {
        let span = self.span(open);
        self.r.error_help("E0007", "this list has no end", span, "close it with ]");
    }

    /// Skips to the end of a list of which something has been said already; what cannot be in a list ends it too.
    pub(super) fn skip_list(&mut self) {
        loop {
            let token = self.lexer().peek();
            match token.kind {
                Kind::Close => {
                    self.lexer().next();
                    return;
                }
                Kind::End | Kind::Open | Kind::Unterminated => return,
                Kind::Word | Kind::Text if self.begins_statement(token) || self.is_parameter(token) => return,
                Kind::Word | Kind::Text => {
                    self.lexer().next();
                }
            }
        }
    }

    /// Adds one value; false when it is of the wrong kind, which is reported.
    pub(super) fn value(&mut self, kind: Type, token: Token, values: &mut Values) -> Parsing<bool> {
        let quoted = token.kind == Kind::Text;
        let bytes = self.lexer().bytes(token).to_vec();
        let wanted = match values {
            Values::Floats(v) => match parse_f32(&bytes) {
                Some(x) if !quoted => {
                    v.push(x);
                    return Ok(true);
                }
                _ => "a number",
            },
            Values::Integers(v) => match parse_i32(&bytes) {
                Some(x) if !quoted => {
                    v.push(x);
                    return Ok(true);
                }
                _ => "a whole number (32 bits)",
            },
            Values::Bools(v) => match &bytes[..] {
                b"true" | b"false" => {
                    v.push(bytes == b"true");
                    return Ok(true);
                }
                b"\"true\"" | b"\"false\"" => {
                    let span = self.span(token);
                    let message = "truth values are written without quotes in pbrt-v4";
                    self.r.push(Diagnostic::new(irradiant_scene::Severity::Note, "N0115", message, span));
                    v.push(bytes == b"\"true\"");
                    return Ok(true);
                }
                _ => "true or false",
            },
            Values::Strings(v) => {
                if quoted {
                    v.push(self.dequote(token)?);
                    return Ok(true);
                }
                if kind == Type::Spectrum { "a string, like the one before" } else { "a string in quotes" }
            }
        };
        let code = match (token.kind, kind) {
            (Kind::Word, Type::Integer) if parse_f64(&bytes).is_some() => "E0012",
            (Kind::Word, _) if is_not_finite(&bytes) => "E0011",
            _ => "E0010",
        };
        // Reported; the rest of the list is skipped by the caller.
        let _ = self.expected::<()>(code, token, wanted);
        Ok(false)
    }
}

fn is_not_finite(bytes: &[u8]) -> bool {
    std::str::from_utf8(bytes).ok().and_then(|t| t.parse::<f32>().ok()).is_some_and(|v| !v.is_finite())
}
