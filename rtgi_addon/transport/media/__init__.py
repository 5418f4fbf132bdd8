"""What fills space between surfaces: phase functions, transmittance along rays, where a medium is.

What media do to light, and a surface plays no part in, comes in here. Arrays are of rays and points; nothing here knows lamps.
"""
