"""What a lamp sees: its shadow views as cameras, and reflective shadow maps captured through them.

What is rendered from a light's or an eye's place into a map comes in here.
"""
