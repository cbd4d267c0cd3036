//! Licences that a dataset can be published under.

use std::fmt;
use std::str::FromStr;

/// Name on the Hugging Face hub, SPDX identifier, title. Those of the hub's list that SPDX knows too, so that one
/// answer serves the card and the metadata; without those that were written for programs or models alone.
const LICENSES: [(&str, &str, &str); 35] = [
    ("afl-3.0", "AFL-3.0", "Academic Free License 3.0"),
    ("apache-2.0", "Apache-2.0", "Apache License 2.0"),
    ("artistic-2.0", "Artistic-2.0", "Artistic License 2.0"),
    ("bsd-2-clause", "BSD-2-Clause", "BSD 2-Clause License"),
    ("bsd-3-clause", "BSD-3-Clause", "BSD 3-Clause License"),
    ("bsl-1.0", "BSL-1.0", "Boost Software License 1.0"),
    ("c-uda", "C-UDA-1.0", "Computational Use of Data Agreement 1.0"),
    ("cc-by-2.0", "CC-BY-2.0", "Creative Commons Attribution 2.0"),
    ("cc-by-2.5", "CC-BY-2.5", "Creative Commons Attribution 2.5"),
    ("cc-by-3.0", "CC-BY-3.0", "Creative Commons Attribution 3.0"),
    ("cc-by-4.0", "CC-BY-4.0", "Creative Commons Attribution 4.0 International"),
    ("cc-by-nc-2.0", "CC-BY-NC-2.0", "Creative Commons Attribution-NonCommercial 2.0"),
    ("cc-by-nc-3.0", "CC-BY-NC-3.0", "Creative Commons Attribution-NonCommercial 3.0"),
    ("cc-by-nc-4.0", "CC-BY-NC-4.0", "Creative Commons Attribution-NonCommercial 4.0 International"),
    ("cc-by-nc-nd-3.0", "CC-BY-NC-ND-3.0", "Creative Commons Attribution-NonCommercial-NoDerivatives 3.0"),
    (
        "cc-by-nc-nd-4.0",
        "CC-BY-NC-ND-4.0",
        "Creative Commons Attribution-NonCommercial-NoDerivatives 4.0 International",
    ),
    ("cc-by-nc-sa-2.0", "CC-BY-NC-SA-2.0", "Creative Commons Attribution-NonCommercial-ShareAlike 2.0"),
    ("cc-by-nc-sa-3.0", "CC-BY-NC-SA-3.0", "Creative Commons Attribution-NonCommercial-ShareAlike 3.0"),
    ("cc-by-nc-sa-4.0", "CC-BY-NC-SA-4.0", "Creative Commons Attribution-NonCommercial-ShareAlike 4.0 International"),
    ("cc-by-nd-4.0", "CC-BY-ND-4.0", "Creative Commons Attribution-NoDerivatives 4.0 International"),
    ("cc-by-sa-3.0", "CC-BY-SA-3.0", "Creative Commons Attribution-ShareAlike 3.0"),
    ("cc-by-sa-4.0", "CC-BY-SA-4.0", "Creative Commons Attribution-ShareAlike 4.0 International"),
    ("cc0-1.0", "CC0-1.0", "Creative Commons Zero 1.0 Universal"),
    ("cdla-permissive-1.0", "CDLA-Permissive-1.0", "Community Data License Agreement Permissive 1.0"),
    ("cdla-permissive-2.0", "CDLA-Permissive-2.0", "Community Data License Agreement Permissive 2.0"),
    ("cdla-sharing-1.0", "CDLA-Sharing-1.0", "Community Data License Agreement Sharing 1.0"),
    ("etalab-2.0", "etalab-2.0", "Etalab Open License 2.0"),
    ("isc", "ISC", "ISC License"),
    ("mit", "MIT", "MIT License"),
    ("mpl-2.0", "MPL-2.0", "Mozilla Public License 2.0"),
    ("odbl", "ODbL-1.0", "Open Data Commons Open Database License 1.0"),
    ("odc-by", "ODC-By-1.0", "Open Data Commons Attribution License 1.0"),
    ("pddl", "PDDL-1.0", "Open Data Commons Public Domain Dedication and License 1.0"),
    ("unlicense", "Unlicense", "The Unlicense"),
    ("zlib", "Zlib", "zlib License"),
];

/// A licence that card and metadata can name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct License {
    /// Its name on the Hugging Face hub, e.g. `cc-by-4.0`.
    pub hub: &'static str,
    /// Its SPDX identifier, e.g. `CC-BY-4.0`.
    pub spdx: &'static str,
    /// Its title.
    pub title: &'static str,
}

/// No licence of this name is known.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no licence {found:?} is known; known are {}", known())]
pub struct UnknownLicense {
    /// What was asked for.
    pub found: String,
}

impl License {
    /// Every known licence.
    pub fn all() -> impl Iterator<Item = Self> {
        LICENSES.into_iter().map(|(hub, spdx, title)| Self { hub, spdx, title })
    }

    /// Its page at SPDX.
    pub fn url(self) -> String {
        format!("https://spdx.org/licenses/{}", self.spdx)
    }
}

impl FromStr for License {
    type Err = UnknownLicense;

    /// By hub name or SPDX identifier, in any case.
    fn from_str(text: &str) -> Result<Self, UnknownLicense> {
        let is_named = |license: &Self| [license.hub, license.spdx].iter().any(|name| name.eq_ignore_ascii_case(text));
        Self::all().find(is_named).ok_or_else(|| UnknownLicense { found: text.to_owned() })
    }
}

impl fmt::Display for License {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.title, self.spdx)
    }
}

fn known() -> String {
    LICENSES.map(|(hub, _, _)| hub).join(", ")
}
