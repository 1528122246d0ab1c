from .catalogue import (
    DIAGNOSIS_FIGURES as DIAGNOSIS_FIGURES,
    FIGURES as FIGURES,
    FRICTION_FIGURES as FRICTION_FIGURES,
    PUBLISHED_FIGURES as PUBLISHED_FIGURES,
)
from .record import FigureOf as FigureOf
from .style import house_style as house_style
