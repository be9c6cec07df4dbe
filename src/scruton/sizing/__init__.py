"""Sizing: from the posterior to a damper and the risk that it leaves."""
