"""What `rotorid balance` prints, writes and draws beside the correction itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from balancing import Correction, Influence
    from balancing.correction.check_result import CheckComparison
    from balancing.correction.history import History
    from balancing.correction.subsets import Subsets
    from balancing.correction.trade_off import TradeOff
    from balancing.correction.verdict import Verdict
    from balancing.mounting.mounted_result import Mounted
    from rotorid.tables import Job


@dataclass
class Report:
    """A correction and what was asked for beside it."""

    result: Correction
    influence: Influence
    check: CheckComparison | None = None
    subsets: Subsets | None = None
    curve: TradeOff | None = None
    mounted: Mounted | None = None
    verdict: Verdict | None = None
    history: History | None = None

    def add_history(self, job: Job) -> None:
        """Run by run, what was mounted and what vibrated."""
        from balancing.correction.history import history

        checks = () if job.check is None else (job.check,)
        mounted = None if job.check is None or job.check_mounted else self.result
        limits = None
        if job.limits is not None:
            limits = job.limits_of(self.influence.planes)
        self.history = history(job.trials, *checks, corrections=mounted, limits=limits)

    def add_trade_off(self, job: Job) -> None:
        """Residual against total weight, in the planes used."""
        from balancing.correction.trade_off import trade_off

        W, Y, rows = self._stack(job, self.result.planes)
        self.curve = trade_off(
            W,
            Y,
            self.result.planes,
            criterion="max" if self.result.method == "minmax" else "rms",
            row_weights=rows,
            labels=self.result.labels,
        )

    def to_dict(self) -> dict[str, Any]:
        """As JSON types."""
        parts = {
            "mounting": self.mounted,
            "check": self.check,
            "verdict": self.verdict,
            "best_planes": self.subsets,
            "trade_off": self.curve,
            "history": self.history,
        }
        return {
            **self.result.to_dict(),
            **{key: part.to_dict() for key, part in parts.items() if part is not None},
        }

    def frame(self) -> pd.DataFrame:
        """The weights, or what goes into each hole."""
        return self.result.to_frame() if self.mounted is None else self.mounted.to_frame()

    def text(self) -> str:
        """For the terminal."""
        parts = (self.result, self.mounted, self.check, self.verdict, self.subsets, self.curve, self.history)
        blocks = [part.summary() for part in parts if part is not None]
        if self.result.limits is not None and (self.subsets or self.curve):
            blocks.append("The comparison of planes and the trade-off do not look at the limits.")
        return "\n\n".join(blocks)

    def figure(self) -> Figure:
        """The correction, or the discs with their holes or the trade-off where they were asked for."""
        from balancing.plots import discs as plots_discs
        from balancing.plots import polar as plots
        from balancing.plots import trade_off_curve as plots_tradeoff

        m = self.mounted
        if m is not None:
            planes = self.result.planes
            return plots_discs.discs(
                self.result,
                {p: h for p, h in zip(planes, m.holes, strict=True) if h is not None},
                {p: k for p, k in zip(planes, m.found.mountings, strict=True) if k is not None},
                clockwise=self.result.labels.drawn_sign < 0,
            )
        if self.verdict is not None and any(row.kind == "plane" for row in self.verdict.rows):
            return self._with_tolerance(self.verdict)
        return plots.overview(self.result) if self.curve is None else plots_tradeoff.overview(self.curve)

    def sheet(self, document: dict[str, Any], job: Job, provenance: dict[str, Any]) -> bytes:
        """To print: one HTML file."""
        from rotorid.report.balance import balance_report

        return balance_report(
            document,
            self.result,
            self.influence,
            job,
            provenance,
            mounted=self.mounted,
            verdict=self.verdict,
        )

    def _with_tolerance(self, verdict: Verdict) -> Figure:
        """Corrections, and residual unbalance inside or outside its tolerance circles."""
        from matplotlib.figure import Figure

        from balancing.plots import polar as plots
        from balancing.plots.tolerances import residuals

        figure = Figure(figsize=(11, 7.5), layout="constrained")
        plots.corrections(self.result, figure.add_subplot(1, 2, 1, projection="polar"))
        residuals(verdict, figure.add_subplot(1, 2, 2, projection="polar"))
        return figure

    def _stack(self, job: Job, planes: tuple[str, ...]) -> tuple[Any, Any, Any]:
        """W (N, P), Y (N,) and row weights (N,) of the speeds used."""
        from balancing.coefficients.baseline import match_speeds

        at = match_speeds(self.result.speeds, self.influence.speeds)
        columns = [self.influence.planes.index(p) for p in planes]
        W = self.influence.W[at][..., columns].reshape(-1, len(columns))
        rows = None if job.row_weights is None else job.row_weights[at].ravel()
        return W, self.result.before.ravel(), rows
