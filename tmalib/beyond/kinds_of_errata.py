"""What each erratum is about: mathematics, what numbers were computed with, or words. Sorted by us."""

MATHEMATICS, SETTING, WORDS = "mathematics", "what was computed", "words"
KINDS = {  # of the errata: a theorem or equation; what numbers were computed with; a claim, symbol or name
    SETTING: (
        "emw-1 emw-2 emw-3 emw-4 emw-5 emw-7 conical-12 conical-14 conical-15 conical-16 conical-18"
        " conical-19 conical-20 robustness-16 robustness-18"
    ),
    MATHEMATICS: (
        "emw-8 conical-1 conical-2 conical-3 conical-4 conical-5 conical-6 conical-6b conical-7 conical-7c"
        " conical-8 conical-9 conical-10 conical-11 conical-21 robustness-1 robustness-2 robustness-3"
        " robustness-4 robustness-5 robustness-6 robustness-7 robustness-8 robustness-9 robustness-10"
        " robustness-11 robustness-12 robustness-13 robustness-17"
    ),
    WORDS: (
        "emw-9 emw-10 emw-11 emw-12 conical-13 conical-17 conical-22 conical-23 robustness-14 robustness-15"
    ),
}
KIND_OF = {erratum: kind for kind, errata in KINDS.items() for erratum in errata.split()}
BY_RUNS_ONLY = ("emw-2", "emw-3", "emw-5", "emw-7", "conical-18", "robustness-18")  # no bound depends on them
