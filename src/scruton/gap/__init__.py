"""Gap: where the null model and the measurement part, which effect causes it, and how far it shrinks once added."""
