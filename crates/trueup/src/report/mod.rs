//! What is told of a panorama: measures, evaluation against the truth, and why photographs were left out.

pub(crate) mod brightness;
pub(crate) mod evaluation;
pub(crate) mod evidence;
pub(crate) mod judgement;
pub(crate) mod left_out;
pub(crate) mod measures;
pub(crate) mod measuring;
pub(crate) mod several;
pub(crate) mod shown;
pub(crate) mod sideways;
