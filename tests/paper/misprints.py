"""The paper's misprints, sections 2 to 4: what is printed, what is meant, what depends on it.

Search for `[misprint: tag]` to find where the corrected formula is used or tested.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Misprint:
    """`slip` marks one that changes no formula: a letter or a stray sign of the typesetting."""

    tag: str
    printed: str
    corrected: str
    why: str
    slip: bool = False


MISPRINTS = (
    Misprint(
        "product-to-n",
        r"$g_1\cdots g_n=g$",
        r"$g_1\cdots g_N=g$",
        "the sequence has N members",
        slip=True,
    ),
    Misprint(
        "omega-sign",
        r"$\Omega=-d\Theta^\pm$ together with"
        r" $\Omega(X^{(1,0)},Y^{(0,1)})=+\overleftarrow{Y}(\overrightarrow{X}(L_d))$",
        r"$\Omega=d\Theta^\pm$",
        r"by $d\Theta(X,Y)=X\Theta(Y)-Y\Theta(X)-\Theta([X,Y])$; the bench keeps the second"
        r" formula, and neither symplecticity nor regularity depends on the sign",
    ),
    Misprint(
        "FL-transposed",
        r"lower right block of $TF^-$: $-FL_d$",
        r"$-(FL_d)^T$",
        r"γ is the row of $(FL_d)^\gamma_\mu$, and the column of"
        r" $\partial F^-_\mu/\partial u^\gamma$; the formulas with indices are right, and say"
        r" $W=-(FL)^TL$ in matrices",
    ),
    Misprint(
        "barred-signs",
        r"$\overleftarrow{e_\gamma}=-\rho \partial_{\bar x}+R \partial_{\bar u}$,"
        r" $\overrightarrow{e_\gamma}=L \partial_{\bar u}$",
        r"$\overleftarrow{e_\gamma}=\rho \partial_{\bar x}-R \partial_{\bar u}$,"
        r" $\overrightarrow{e_\gamma}=-L \partial_{\bar u}$",
        r"by $Ti\circ\overrightarrow{X}=-\overleftarrow{X}\circ i$, the paper's (5); both signs"
        " turn, so the discrete Euler–Lagrange equations stay the same",
    ),
    Misprint(
        "dtau-step",
        r"$T_\xi\tau(\eta)=d\tau_\xi(\eta) \tau(h\xi)$",
        r"$d\tau_\xi(\eta) \tau(\xi)$",
        "no step has been introduced there yet",
    ),
    Misprint(
        "so3-square",
        r"$1+\frac{h^2z}4$; $1+\frac{h^2\Omega_3}4$ (twice each, in the third equation)",
        r"$1+\frac{h^2z^2}4$; $1+\frac{h^2\Omega_3^2}4$",
        "as in the first two equations",
    ),
    Misprint(
        "dangling-plus",
        r"$(\frac{h^2xy}4-\frac{hz}2+ )$ in the second equation",
        r"$(\frac{h^2xy}4-\frac{hz}2)$",
        "nothing is missing",
        slip=True,
    ),
    Misprint(
        "L-for-L_d",
        r"$\overleftarrow{C_\eta}(L)-\overrightarrow{C_\eta}(L)=0$, $\eta$ in $g$",
        r"$\overleftarrow{C_\eta}(L_d)-\overrightarrow{C_\eta}(L_d)=0$, $\eta$ in $\tilde g$",
        "the function on the groupoid is the discrete one",
    ),
    Misprint(
        "flow-step",
        r"$\Phi_{\xi_M}(t,x)=x\exp(t(h\xi))$",
        r"$x\exp(t\xi)$",
        r"else $-h(e_\gamma)_M$, as it is used from there on, would hold the step twice",
    ),
    Misprint(
        "heavy-top-field",
        r"$\overrightarrow{C_{e_\gamma}}=(+h\Gamma e_\gamma,\dots)$",
        r"$(-h\Gamma e_\gamma,\dots)$",
        r"the field is $-h(e_\gamma)_M$, and the equations that follow have the right sign",
    ),
    Misprint(
        "heavy-top-torque",
        r"$+hmgd(Z_{k+1}e_2-Y_{k+1}e_3)$ and so on, in all three components",
        r"$-hmgd(Z_{k+1}e_2-Y_{k+1}e_3)$ and so on",
        r"$\partial L_c/\partial\Gamma=-mgd e$; as printed gravity pulls upwards",
    ),
    Misprint(
        "implicit2",
        r"$\rho \partial_{\bar x}\partial_{\bar u}(L_d\circ R_{\Upsilon_0})-\dots"
        r"-L^\nu_\mu \partial_{\bar u^\nu}\partial_{\bar u^\gamma}(L_d\circ R_{\Upsilon_0})$",
        r"$L_d\circ L_{\Sigma_0}$ throughout, and $R^\nu_\mu$ in the last term",
        r"it is the derivative of (39) along $\bar v$, which stands in $L_d\circ L_{\Sigma_0}$",
    ),
)
