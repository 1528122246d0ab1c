"""Which mechanisms a design cannot show: what the calibration takes up, and what the errors of the model hide."""

from __future__ import annotations

from laboratories.campaign import make
from laboratories.effects import hide_effect
from laboratories.handed_over import handed_over
from laboratories.laboratory import drawn_laboratory

from tribo.diagnostics.fit import fit
from tribo.diagnostics.model import setup
from tribo.diagnostics.observations import observe
from tribo.diagnostics.predictor import tabled_predictor
from tribo.diagnostics.score_statistics import start_effects

SEED = 81326641  # patterns of odd shapes, whose errors take up nearly all that the flat sample leaves of such a load


def test_a_load_error_that_the_flat_sample_takes_up_for_the_most_part_is_weighed_by_the_rest() -> None:
    made = make(SEED, drawn_laboratory(SEED), hide=hide_effect("normal_load_error", 2.5))
    o = observe(handed_over(made.bench, SEED, ("film_um", "recipe", "lot")))
    effects = start_effects(fit(setup(o, tabled_predictor(o.patterns))))
    assert "normal_load_error" not in effects.absorbed
    assert "suction" not in effects.absorbed
    assert effects.absorbed["pulley_friction"] == "absorbed"
