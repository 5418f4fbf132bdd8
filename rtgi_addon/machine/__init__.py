"""What this machine lets a process have: memory, as the system, its control groups and its own limits say. What asks the system
what there is comes in; what it is wanted for is known above.
"""
