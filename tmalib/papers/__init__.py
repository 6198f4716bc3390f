"""The papers, a folder each: manifest, ledger, scenarios, experiments, drawings."""
