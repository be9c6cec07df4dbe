"""Gap: where the bare model and the measurement part, which effect causes it, and how far it shrinks once added."""
