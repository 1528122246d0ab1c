from .catalogue import (
    DIAGNOSIS_FIGURES as DIAGNOSIS_FIGURES,
    FIGURES as FIGURES,
    FRICTION_FIGURES as FRICTION_FIGURES,
    PUBLISHED_FIGURES as PUBLISHED_FIGURES,
)
from .style import FigureOf as FigureOf, house_style as house_style
