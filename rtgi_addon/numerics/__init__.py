"""Mathematics on arrays (rank 0): spherical harmonics, octahedral maps, low-discrepancy numbers, lattices.

It knows neither scenes nor light. A formula that two systems share and that names nothing of theirs comes in here.
"""
