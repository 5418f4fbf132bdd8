"""Light on a lattice of SH probes as everyone reads it: field, look-up, dilation, reconstruction, placement, resampling.

How probes get their light is a technique's own affair (`techniques/probes/` for one); what a reader of probes shares, in whatever
technique, preview or engine, comes in here.
"""
