"""Laws of aerodynamic damping: the n-family, and what a law outside it must state (`scruton.dynamics.laws.law`)."""

from scruton.dynamics.laws.family import LAWS as LAWS
from scruton.dynamics.laws.family import amplitude_ratio as amplitude_ratio
from scruton.dynamics.laws.family import closed_form as closed_form
from scruton.dynamics.laws.family import extrapolation_index as extrapolation_index
from scruton.dynamics.laws.family import flow_derivative as flow_derivative
from scruton.dynamics.laws.family import index_of as index_of
from scruton.dynamics.laws.family import larsen as larsen
from scruton.dynamics.laws.family import rate as rate
