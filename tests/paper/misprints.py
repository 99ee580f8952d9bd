"""Where the paper, sections 2 to 4, is printed otherwise than meant, in three classes.

Search for `[misprint: tag]` to find where a corrected formula is used or tested.
"""

from __future__ import annotations

from dataclasses import dataclass

FORMULA, SLIP, NOTATION = "formula", "slip", "notation"


@dataclass(frozen=True)
class Misprint:
    """What is printed, what is meant, and why; `then`: what follows where the formula is used.

    kind: FORMULA is false as printed, SLIP a wrong letter or word that no formula depends on,
    NOTATION right, if it is read as said. `where`: of what stands in no row of the table.
    """

    kind: str
    tag: str
    printed: str
    corrected: str
    why: str = ""
    then: str = ""
    where: str = ""


MISPRINTS = (
    Misprint(FORMULA, "omega-sign",
        r"$\Omega=-d\Theta^\pm$ together with"
        r" $\Omega(X^{(1,0)},Y^{(0,1)})=+\overleftarrow{Y}(\overrightarrow{X}(L_d))$",
        r"$\Omega=d\Theta^\pm$",
        r"by $d\Theta(X,Y)=X\Theta(Y)-Y\Theta(X)-\Theta([X,Y])$; the bench keeps the second one",
        "none: neither symplecticity nor regularity depends on the sign"),
    Misprint(FORMULA, "barred-signs",
        r"$\overleftarrow{e_\gamma}=-\rho \partial_{\bar x}+R \partial_{\bar u}$,"
        r" $\overrightarrow{e_\gamma}=L \partial_{\bar u}$",
        r"$\overleftarrow{e_\gamma}=\rho \partial_{\bar x}-R \partial_{\bar u}$,"
        r" $\overrightarrow{e_\gamma}=-L \partial_{\bar u}$",
        r"by $Ti\circ\overrightarrow{X}=-\overleftarrow{X}\circ i$, the paper's (5)",
        "none for the discrete Euler–Lagrange equations: both fields turn, so that (39) is theirs"
        " times −1"),
    Misprint(FORMULA, "dtau-step",
        r"$T_\xi\tau(\eta)=d\tau_\xi(\eta) \tau(h\xi)$",
        r"$d\tau_\xi(\eta) \tau(\xi)$",
        "no step has been introduced there yet",
        "none: what follows has the step in its place"),
    Misprint(FORMULA, "fields-step",
        r"$\overleftarrow{e_\gamma}(\eta)=d\tau^{-1}_{h\eta}(Ad_{\tau(h\eta)}e_\gamma)$ and"
        r" $\overrightarrow{e_\gamma}(\eta)$, $e_\gamma$ the basis of the algebra",
        r"$\frac1h$ before both, or $e_\gamma=\partial_{u^\gamma}$, $h$ times the basis",
        r"$\eta$ is the coordinate of $\tau(h\eta)$",
        r"none for the equations, where the factor is common; $-h(e_\gamma)_M$ in 3.7 is without"
        r" the $\frac1h$"),
    Misprint(FORMULA, "so3-square",
        r"$1+\frac{h^2z}4$; $1+\frac{h^2\Omega_3}4$ (twice each, in the third equation)",
        r"$1+\frac{h^2z^2}4$; $1+\frac{h^2\Omega_3^2}4$",
        "as in the first two equations",
        "the third equation as printed is no component of the equations above it"),
    Misprint(FORMULA, "L-for-L_d",
        r"$\overleftarrow{C_\eta}(L)-\overrightarrow{C_\eta}(L)=0$",
        r"$\overleftarrow{C_\eta}(L_d)-\overrightarrow{C_\eta}(L_d)=0$",
        "the function on the groupoid is the discrete one",
        "none: $L$ is not used again there"),
    Misprint(FORMULA, "heavy-top-field",
        r"$\overrightarrow{C_{e_\gamma}}=(+h\Gamma e_\gamma,\dots)$",
        r"$(-h\Gamma e_\gamma,\dots)$",
        r"the field is $-h(e_\gamma)_M$",
        "the next entry; the equations in between have the right sign"),
    Misprint(FORMULA, "heavy-top-torque",
        r"$+hmgd(Z_{k+1}e_2-Y_{k+1}e_3)$ and so on, in all three components",
        r"$-hmgd(Z_{k+1}e_2-Y_{k+1}e_3)$ and so on",
        r"$\partial L_c/\partial\Gamma=-mgd e$; follows from the sign of the field, and is asserted"
        " to follow",
        "gravity pulls upwards"),
    Misprint(FORMULA, "implicit2",
        r"$\rho \partial_{\bar x}\partial_{\bar u}(L_d\circ R_{\Upsilon_0})-\dots"
        r"-L^\nu_\mu \partial_{\bar u^\nu}\partial_{\bar u^\gamma}(L_d\circ R_{\Upsilon_0})$",
        r"$L_d\circ L_{\Sigma_0}$ throughout, and $R^\nu_\mu$ in the last term",
        r"it is the derivative of (39) along $\bar v$, at $(\bar y,\bar v)$, which stands in"
        r" $L_d\circ L_{\Sigma_0}$",
        "Theorem 4.10 is false with the printed matrix: see the counterexample in 4.2"),
    Misprint(SLIP, "parenthesis",
        r"$(T_hl_g)(\tilde X_h)$, $(T_gr_h)(\tilde X(g)))$",
        r"$(T_hl_g)(\tilde X(h))$, $(T_gr_h)(\tilde X(g))$"),
    Misprint(SLIP, "product-to-n", r"$g_1\cdots g_n=g$", r"$g_1\cdots g_N=g$"),
    Misprint(SLIP, "X-at-beta",
        r"$\Omega(X_\gamma^{(1,0)},Y_\mu^{(1,0)})=\Omega(X_\gamma^{(0,1)},Y_\mu^{(0,1)})=0$",
        r"$\Omega(X_\gamma^{(1,0)},X_\mu^{(1,0)})=\Omega(Y_\gamma^{(0,1)},Y_\mu^{(0,1)})=0$",
        r"$X_\gamma$ is a basis near $\alpha(g)$, $Y_\mu$ near $\beta(g)$"),
    Misprint(SLIP, "V-without-name",
        r"a basis in an open subset $U$ with $\alpha(h)\in U$ (resp. $\beta(g)\in V$)",
        r"in open subsets $U$ (resp. $V$)"),
    Misprint(SLIP, "h-for-h0",
        r"the differential at the point $h\equiv(y_0,v_0)$",
        r"$h_0\equiv(y_0,v_0)$"),
    Misprint(SLIP, "above-theorem",
        "in the proof of the above theorem",
        "of the above proposition",
        where="3.5 after the remark"),
    Misprint(
        SLIP, "so3-for-g", r"with $\eta\in so(3)$", r"$\eta\in g$", "the formulas are general"
    ),
    Misprint(SLIP, "Lie-Poincare", "the Lie–Poincaré equations", "the Euler–Poincaré equations"),
    Misprint(SLIP, "dangling-plus",
        r"$(\frac{h^2xy}4-\frac{hz}2+ )$ in the second equation",
        r"$(\frac{h^2xy}4-\frac{hz}2)$",
        "nothing is missing"),
    Misprint(SLIP, "values-in-g",
        r"$C_\eta:M\to\tilde g$, $C_\eta(x)=(x,\eta)$",
        r"$C_\eta:M\to M\times\tilde g$"),
    Misprint(SLIP, "g-without-tilde", r"$\eta\in g$, $\tilde\xi\in g$", r"$\tilde g$, twice"),
    Misprint(SLIP, "basis-on-SO3", r"the standard basis on $SO(3)$", r"of $so(3)$"),
    Misprint(SLIP, "alpha-without-bar",
        r"$Im((\alpha_\Sigma)^{-1})$ in the proof of Proposition 4.2",
        r"the inverse of $\alpha$ restricted to $\Sigma$"),
    Misprint(SLIP, "W-lower-beta",
        r"$g\in W^\alpha\cap W_\beta$ in the proof of Proposition 4.6",
        r"$W^\alpha\cap W^\beta$"),
    Misprint(SLIP, "preserves-alpha",
        r"since $L_\Sigma$ preserves the $\alpha$-fibers",
        r"it maps $\alpha$-fibers to $\alpha$-fibers; those it preserves are the $\beta$-fibers"),
    Misprint(SLIP, "R-for-r",
        r"$R_\Sigma\circ r_g=R_{g\cdot\Sigma}$",
        r"$r_{g\cdot\Sigma}$",
        r"$g\cdot\Sigma$ is an arrow"),
    Misprint(SLIP, "local-diffeomorphism",
        "injective, as it is the restriction of a local diffeomorphism",
        "of a diffeomorphism",
        "a local one need not be injective; (c) finds its $x$ near $x_0$ only"),
    Misprint(SLIP, "x0-u0-v0",
        r"$\bar v$ in terms of $\bar x$ and $\bar u$ near $(x_0,u_0,v_0)$",
        r"near $(x_0,0,0)$",
        r"$g_0$ and $h_0$ have the coordinates $(x_0,0)$ there"),
    Misprint(SLIP, "FL-without-d",
        r"$\overline{(FL)}$, and $(FL)(x_0,0)$ in the proof of Theorem 4.10",
        r"$\overline{(FL_d)}$, $(FL_d)(x_0,0)$"),
    Misprint(NOTATION, "FL-transposed",
        r"lower right block of $TF^-$: $-FL_d$",
        r"$-(FL_d)^T$, if the upper index is the row",
        r"γ is the column of $\partial F^-_\mu/\partial u^\gamma$; the formulas with indices are"
        r" right, and say $W=-(FL)^TL$ in matrices"),
    Misprint(NOTATION, "flow-step",
        r"$\Phi_{\xi_M}(t,x)=x\exp(t(h\xi))$",
        r"$x\exp(t\xi)$, if $\xi_M$ is the generator of $\xi$ and not of $h\xi$",
        r"else $-h(e_\gamma)_M$, as it is used from there on, would hold the step twice"),
    Misprint(NOTATION, "l-for-L_d",
        r"a Lagrangian $l$, and $L_c$ of the heavy top, in the discrete equations",
        r"the discrete Lagrangian, $hl$ and $hL_c$",
        "the factor is common to all terms"),
    Misprint(NOTATION, "E-for-AG", r"$\tau:E\to M$", r"$\tau:AG\to M$ of section 2"),
    Misprint(NOTATION, "alpha-as-index",
        r"$(FL_d)^\alpha_\beta(y_0,v_0)$ in Proposition 3.2",
        r"$(FL_d)^\gamma_\mu(y_0,v_0)$",
        r"$\alpha$ and $\beta$ are the source and the target"),
    Misprint(NOTATION, "upper-w",
        r"$w^\gamma(h_0)=TR_{\Upsilon_0}(\partial_{u^\gamma})$",
        r"$w_\gamma(h_0)$, as $\partial_{u^\gamma}$"),
    Misprint(NOTATION, "y-on-V",
        r"$(y)$, the local coordinates on $V\ni x_0$",
        r"$(x)$ for $\alpha(g_W)$, $(y)$ for $\alpha(h_W)$, of one chart",
        where="4.2 before display 3"),
)  # fmt: skip
