"""Motion in time of the reference rotor under unbalance, until it is steady.

Against ROSS' `Rotor.run_time_response` with its two methods: the equations of one speed with a state-space
matrix (scipy's `lsim`), and Newmark's. All unknowns of the rotor move, on damped bearings that are linear, since
ROSS has no journal bearing that is not; 0.5 s at 3,000 rpm, 2,001 steps of output.

Answers: the amplitude of the last turn against the steady response, which the same programs compute in frequency.
"""
