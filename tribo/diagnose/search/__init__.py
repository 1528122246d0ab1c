"""The search for causes: looks at the residuals, their screening, weighing and naming."""
