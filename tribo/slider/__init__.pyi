from .contact_laws import SLIDER_LAWS as SLIDER_LAWS, SliderLaw as SliderLaw
from .motion import (
    Drive as Drive,
    constant_speed as constant_speed,
    recorded_displacement as recorded_displacement,
    sinusoid as sinusoid,
    slide_hold_slide as slide_hold_slide,
    speed_steps as speed_steps,
)
from .oscillator import (
    critical_speed_m_s as critical_speed_m_s,
    critical_stiffness_N_per_m as critical_stiffness_N_per_m,
    steady_sliding_speed_m_s as steady_sliding_speed_m_s,
)
from .slider_files import read_slider_law as read_slider_law, write_slider_run as write_slider_run
from .slider_run import SliderConfig as SliderConfig, SliderRun as SliderRun, simulate_slider as simulate_slider
