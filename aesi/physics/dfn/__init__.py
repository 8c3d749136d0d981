"""The porous electrode: the model of Doyle, Fuller and Newman, compiled.

    d(eps c)/dt = d/dx (B D(c) dc/dx) + (1 - t+) a j,            B : transport efficiency
    i_e = -B kappa(c) (d phi_e/dx - 2 (1 - t+) R T / F  d ln c/dx),   i_s = -sigma d phi_s/dx,   i_e + i_s = I / A
    d i_e/dx = a F j = a 2 i0 sinh(F (phi_s - phi_e - U) / 2 R T),   i0 = F K sqrt(c/c0 x (1 - x))
    dx/dt = 1/r^2 d/dr (r^2 D(x) dx/dr) in a particle at every place

Across each electrode the reaction is a polynomial through Gauss points, each with its own particles (see
`SphereModes`); the salt is one polynomial a layer (Galerkin). Potentials are integrals of the reaction, so what is left
to solve at each step is one small dense system: the reaction at the points and the potential of each collector, with
the surface of each particle and the salt as linear functions of them. Modes are stepped exactly for a reaction that
runs straight from the start of a step to its end (second order), and by Newton's method from where the last step ended.

Doyle, Fuller & Newman, J. Electrochem. Soc. 140 (1993) 1526, doi:10.1149/1.2221597.
"""
