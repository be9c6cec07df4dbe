from scruton.campaign import Campaign as Campaign
from scruton.campaign import load_campaign as load_campaign
from scruton.campaign import tests_used as tests_used
from scruton.errors import InputError as InputError
from scruton.gap.results import load_diagnosis as load_diagnosis
from scruton.griffin import Prediction as Prediction
from scruton.griffin import griffin_band as griffin_band
from scruton.griffin import predict as predict
from scruton.infer import ModelCard as ModelCard
from scruton.infer import load_card as load_card
from scruton.infer.fit import fit_campaign as fit_campaign
from scruton.infer.results import Fit as Fit
from scruton.infer.store import load_fit as load_fit
from scruton.infer.store import read_tree as read_tree
from scruton.infer.store import write_fit as write_fit
from scruton.report import build_report as build_report
from scruton.simulate import write_campaign as write_campaign
from scruton.sizing.results import Sizing as Sizing
from scruton.sizing.results import load_sizing as load_sizing

__version__: str
