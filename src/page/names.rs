//! Shortens the names that a script declares. Properties, words of the language and names of the browser stay as they are.
//!
//! A name is the same everywhere: all its variables get the same short name, which is that of nothing else. So scopes need not be known.
//!
//! # Invariants
//!
//! A word that some part of a script declares is not used for a thing of the browser elsewhere. Classes declare methods and private
//! fields only, and no statement has a label. A page in a browser shows whether a name is wrong; `tests/page/names.test.mjs` compares the
//! script with its sources by a parser.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use super::tokens::{Kind, Token};

/// The first and the further characters of short names.
const FIRST: &[u8] = b"abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_$";
const FURTHER: &[u8] = b"abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_$0123456789";

/// Words of the language that are as short as short names.
const SHORT_WORDS: [&str; 5] = ["as", "do", "if", "in", "of"];

/// Words that are of the language in some places and names in others: they stay.
const CONTEXTUAL: [&str; 5] = ["of", "async", "get", "set", "static"];

/// Words after which a name is declared.
const DECLARING: [&str; 4] = ["let", "const", "function", "class"];

/// Words after which a brace is that of an object; after other words it is that of a block.
const BEFORE_OBJECT: [&str; 5] = ["return", "let", "const", "of", "in"];

/// Words before parentheses and a block that are no function.
const STATEMENTS: [&str; 4] = ["if", "for", "while", "switch"];

/// What a word is.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Role {
    Property,
    /// A property and a variable with its name: `{ a }`.
    Both,
    Variable,
}

/// What an opening token opens.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Opening {
    Block,
    Class,
    Object,
    /// Parentheses, brackets or an expression of a template.
    List,
}

/// Tokens with the brackets around each.
struct Script<'a, 't> {
    tokens: &'a [Token<'t>],
    /// The innermost opening token around each token, with what it opens.
    around: Vec<Option<(usize, Opening)>>,
    /// The closing token of each opening one.
    closing: Vec<usize>,
}

/// Replaces the names that a script declares by shorter ones.
pub(super) fn shorten(tokens: &mut [Token]) {
    let script = Script::new(tokens);
    let mut declared = BTreeSet::new();
    // The number of bytes by name that depend on its length.
    let mut uses: BTreeMap<&str, usize> = BTreeMap::new();
    let roles: Vec<Option<Role>> = (0..tokens.len()).map(|i| script.role(i)).collect();
    for (i, role) in roles.iter().enumerate() {
        if matches!(role, Some(Role::Variable | Role::Both)) {
            *uses.entry(&tokens[i].text).or_default() += 1;
            if script.declares(i) && !CONTEXTUAL.contains(&&*tokens[i].text) {
                declared.insert(&*tokens[i].text);
            }
        }
    }
    let kept: BTreeSet<&str> =
        uses.keys().copied().filter(|word| !declared.contains(word)).collect();
    let mut names: Vec<&str> = declared.into_iter().collect();
    names.sort_by_key(|&name| (Reverse(uses[name]), name));
    let free =
        short_names().filter(|name| !kept.contains(&**name) && !SHORT_WORDS.contains(&&**name));
    let short: BTreeMap<String, String> = names.into_iter().map(str::to_owned).zip(free).collect();
    for (token, role) in tokens.iter_mut().zip(roles) {
        let (Some(role), Some(name)) = (role, short.get(&*token.text)) else { continue };
        match role {
            Role::Property => {}
            Role::Both if *name == token.text => {}
            Role::Both => token.text = format!("{}:{name}", token.text).into(),
            Role::Variable => token.text = name.clone().into(),
        }
    }
}

/// All names, the shortest first.
fn short_names() -> impl Iterator<Item = String> {
    let text = |bytes: &[u8]| bytes.iter().map(|&c| char::from(c)).collect::<String>();
    let one = FIRST.iter().map(move |&a| text(&[a]));
    let two = FIRST.iter().flat_map(move |&a| FURTHER.iter().map(move |&b| text(&[a, b])));
    one.chain(two)
}

impl<'a, 't> Script<'a, 't> {
    fn new(tokens: &'a [Token<'t>]) -> Self {
        let mut script = Script { tokens, around: Vec::new(), closing: vec![0; tokens.len()] };
        let mut open: Vec<(usize, Opening)> = Vec::new();
        for (i, token) in tokens.iter().enumerate() {
            if token.closes()
                && let Some((start, _)) = open.pop()
            {
                script.closing[start] = i;
            }
            script.around.push(open.last().copied());
            if token.opens() {
                open.push((i, script.opening(i)));
            }
        }
        script
    }

    fn is(&self, i: usize, sign: char) -> bool {
        self.tokens.get(i).is_some_and(|token| token.is(sign))
    }

    fn is_one_of(&self, i: usize, signs: &str) -> bool {
        signs.chars().any(|sign| self.is(i, sign))
    }

    /// The word at a place; empty if there is none.
    fn word(&self, i: usize) -> &str {
        self.tokens.get(i).filter(|token| token.kind == Kind::Word).map_or("", |token| &*token.text)
    }

    fn opening(&self, i: usize) -> Opening {
        if !self.is(i, '{') {
            return Opening::List;
        }
        let Some(last) = i.checked_sub(1) else { return Opening::Block };
        let is_class = ["class", "extends"].contains(&self.word(i.wrapping_sub(2)));
        if is_class {
            Opening::Class
        } else if self.is_one_of(last, "([,=:?&|.") || BEFORE_OBJECT.contains(&self.word(last)) {
            Opening::Object
        } else {
            Opening::Block
        }
    }

    /// What a token is, if it may be a name.
    fn role(&self, i: usize) -> Option<Role> {
        let word = self.word(i);
        if !word.starts_with(|c: char| c.is_alphabetic() || "_$".contains(c)) {
            return None;
        }
        let before = i.wrapping_sub(1);
        let is_spread = self.is(i.wrapping_sub(2), '.');
        if self.is(before, '.') && !is_spread {
            return Some(Role::Property);
        }
        Some(match self.around[i] {
            Some((_, Opening::Class)) => Role::Property,
            Some((_, Opening::Object)) if self.is_one_of(before, "{,") => match () {
                () if self.is_one_of(i + 1, ":(") => Role::Property,
                () if self.is_one_of(i + 1, ",}=") => Role::Both,
                () => Role::Variable,
            },
            _ => Role::Variable,
        })
    }

    /// Whether a variable is declared here: after a word that declares, in a list after one, or among the parameters of a function. In
    /// patterns of objects names are not looked for.
    fn declares(&self, i: usize) -> bool {
        if DECLARING.contains(&self.word(i.wrapping_sub(1))) {
            return true;
        }
        let Some((start, Opening::List)) = self.around[i] else { return false };
        let is_item = self.is_one_of(i - 1, "([,.") && self.is_one_of(i + 1, ",])=");
        is_item
            && (self.is_parameters(start)
                || self.is(start, '[')
                    && ["let", "const"].contains(&self.word(start.wrapping_sub(1))))
    }

    /// Whether parentheses have the parameters of a function.
    fn is_parameters(&self, start: usize) -> bool {
        let after = self.closing[start] + 1;
        let is_arrow = self.is(after, '=') && self.is(after + 1, '>');
        let has_block =
            self.is(after, '{') && !STATEMENTS.contains(&self.word(start.wrapping_sub(1)));
        self.is(start, '(') && (is_arrow || has_block)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page::compact::compact;
    use crate::page::tokens::tokens;

    fn shortened(text: &str) -> String {
        let mut tokens = tokens(text);
        shorten(&mut tokens);
        compact(&tokens)
    }

    #[test]
    fn declared_names_are_shortened_and_others_stay() {
        assert_eq!(
            shortened(
                "const long = document.title;\nfunction other(first, [x], ...rest) { return first + rest + long; }\n"
            ),
            "let b=document.title;function d(a,[x],...c){return a+c+b}\n"
        );
        assert_eq!(
            shortened("const of = 1;\nfor (const c of of) {}\n"),
            "let of=1;for(let a of of){}\n"
        );
        // A name that is in use is not given to another thing.
        assert_eq!(shortened("const long = a;\n"), "let b=a;\n");
        assert_eq!(
            shortened("let [one, two = Infinity] = f(`${one} one`);\n"),
            "let[a,b=Infinity]=f(`${a} one`);\n"
        );
    }

    #[test]
    fn properties_stay() {
        assert_eq!(
            shortened("const long = { long: 1, long() {} }.long + a.long?.long;\n"),
            "let b={long:1,long(){}}.long+a.long?.long;\n"
        );
        assert_eq!(
            shortened(
                "class Long { long() { this.long(); } get other() { return Long; } }\nlet long;\n"
            ),
            "class a{long(){this.long()}get other(){return a}}\nlet b;\n"
        );
    }

    #[test]
    fn a_property_with_the_name_of_a_variable_is_written_with_both() {
        assert_eq!(
            shortened("const f = ({ long, x = 2 }) => { long = x; };\nlet long;\n({ long });\n"),
            "let b=({long:a,x=2})=>{a=x};let a;({long:a});\n"
        );
        assert_eq!(
            shortened("let long = 1;\nif (long) { long = 2, long; }\n"),
            "let a=1;if(a){a=2,a}\n"
        );
    }
}
