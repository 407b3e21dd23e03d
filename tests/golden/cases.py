# ruff: noqa: E501 - a command line is as long as it is
"""The command lines that the net knows, and which of them are stored.

Every command runs in a folder that has a copy of `sample_data`.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class Case:
    """One command line.

    Attributes
    ----------
    name
        Of the stored file.
    command
        As typed after `rotorid`.
    group
        The cases of one group run in one process, one after the other.
    before
        Commands, run first, that make files which this one reads.
    edits
        Files to write before: new name → (sample file, old text, new text).
    """

    name: str
    command: str
    group: str
    before: tuple[str, ...] = ()
    edits: Mapping[str, tuple[str, str, str]] = field(default_factory=dict)

    @property
    def words(self) -> list[str]:
        """After `rotorid`."""
        return shlex.split(self.command)

    @property
    def json_words(self) -> list[str]:
        """After `rotorid`, with `--json`, without pictures and pages; usage and schemas have no document."""
        if self.group == "usage" or self.command.startswith("schema "):
            return self.words
        words = [*self.words, "--json"]
        for option in ("--plot", "--report"):
            if option in words and self.name not in REFUSED_TARGETS:
                del words[words.index(option) : words.index(option) + 2]
        return words


REFUSED_TARGETS = ("critical-two-into-one",)
ROTOR23 = "sample_data/rotor23.csv"
MOTION = "sample_data/motion/rotor.toml"
COMPRESSOR = "sample_data/compressor/rotor.toml"
RESPONSE = f"response {COMPRESSOR} --unbalance sample_data/compressor/unbalance.csv"
CALIBRATE = (
    f'calibrate {COMPRESSOR} sample_data/calibration/trial.toml --estimate "bearing[*].*" '
    '--prior "bearing[*].*=20%"'
)
SUPPORTS = f"calibrate {COMPRESSOR} sample_data/calibration/trial.toml --exact --estimate"
TURBO = "sample_data/turbo_job"
MODEL_JOB = "sample_data/model_job/job.toml"
PRINTED = (
    "reduce --compliance sample_data/book_task_9/compliance_printed.csv "
    "--measured sample_data/book_task_9/modes_printed.csv"
)
GIVEN = (
    "reduce --compliance sample_data/book_task_9/compliance.csv --measured sample_data/book_task_9/modes.csv"
)
IDENTIFY, FIT = "sample_data/identify", "sample_data/fit"
SHAKEN = "modes sample_data/modes/amplitudes.csv --excitation force"
PROBES = '--sensors "probe DE:45,probe NDE:45"'

ROTOR_COMMANDS = f"""
critical-rotor23            critical {ROTOR23} -n 3 --plot modes.png
critical-rotor23-report     critical {ROTOR23} --report rotor.html
critical-model-job          critical sample_data/model_job/rotor.csv -n 2
critical-compressor         critical {COMPRESSOR} -n 4 --operating 5300:6500rpm --output modes.xlsx
critical-compressor-map     critical {COMPRESSOR} -n 3 --map --plot map.png
critical-rk4                critical sample_data/rk4/calibrated.toml -n 2
calibrate-rk4               calibrate sample_data/rk4/rotor.toml sample_data/rk4/few.toml sample_data/rk4/few_1005.toml --estimate "bearing.kxx, bearing.kyy, bearing.cxx, bearing.cyy, bearing.tilting_stiffness, key_phasor.angle, probe[*].gain" --prior "bearing.k*=40%, bearing.c*=40%, bearing.tilting_stiffness=100%, key_phasor.angle=0+-100, probe[*].gain=50%, probe[*].angle=0+-30" --table
critical-misspelt           critical misspelt.csv
critical-missing            critical nowhere.csv
critical-too-many           critical {ROTOR23} -n 1000
critical-two-into-one       critical {ROTOR23} --output modes.csv --plot modes.csv
campbell-rotor23            campbell {ROTOR23} --speeds 50:650:150 -n 4
campbell-model-job          campbell sample_data/model_job/rotor.csv --speeds 1000:6000:1000rpm --output c.csv
campbell-compressor-coarse  campbell {COMPRESSOR} --speeds 2000:14000:3000rpm --operating 5300:6500rpm
campbell-compressor         campbell {COMPRESSOR} --speeds 1000:15000:250rpm --plot campbell.png
campbell-outside            campbell {COMPRESSOR} --speeds 100:500:100rpm
response-coarse             {RESPONSE} --speeds 2000:14000:2000rpm {PROBES} --output response.csv
response-stations           {RESPONSE} --speeds 5000rpm,6000rpm --operating 5300:6500rpm
response-orbits             {RESPONSE} --speeds 4000:6000:500rpm {PROBES} --view orbits --plot o.png
response-report             {RESPONSE} --speeds 4000:10000:3000rpm {PROBES} --report response.html
response-compressor         {RESPONSE} --speeds 1000:15000:50rpm {PROBES} --operating 5300:6500rpm --plot bode.png
response-no-sensor          {RESPONSE} --speeds 5000rpm --sensors "prob DE:45"
bearings                    bearings {MOTION} --speeds 1000:9000:500rpm --plot bearings.png
bearings-linear             bearings {MOTION} --speeds 2000,5000rpm --output linear.toml
bearings-at-rest            bearings {MOTION} --speeds 0:3000:1000rpm
motion                      motion {MOTION} --speed 4000rpm --time 0.1s --displaced left=3um --rate 500 --output m.csv
motion-run-up               motion sample_data/motion/unbalanced.toml --run-up 3000:3300rpm --time 0.5s --rate 200 --sensors 12 --plot m.png
motion-bode                 motion sample_data/motion/unbalanced.toml --run-up 600:6200rpm --time 10s --view bode --plot run_up.png
motion-from-rest            motion sample_data/motion/small.toml --run-up 0:3000rpm --time 1s
periodic-jumps              periodic sample_data/motion/damper.toml --speeds 1000:5000rpm --plot jumps.png
calibrate                   {CALIBRATE}
calibrate-table             {CALIBRATE} --exact --table --output numbers.csv
calibrate-unexplained       {SUPPORTS} bearing.kxx.scale --prior bearing.kxx.scale=30%
calibrate-no-bearing        {SUPPORTS} "bearing[3].kxx.scale"
calibrate-says-nothing      calibrate {COMPRESSOR} sample_data/calibration/later.toml --estimate bearing.kxx.scale
critical-calibrated         critical sample_data/calibration/calibrated.toml -n 2
reduce-keep-supports        reduce {MOTION} --nodes 7,12,18 --damping 0.5,0.5,0.5 --keep-supports --output motion.toml
influence-rotor23           influence {ROTOR23} --planes 7,12,18 --sensors 2,22 --speeds 100:600:5 --output w.csv
influence-coarse            influence {ROTOR23} --planes 7,12,18 --sensors 2:45,22:45 --speeds 100,120
study                       study sample_data/study/study.toml --samples 50
study-misspelt              study misspelt.toml
influence-compressor        influence {COMPRESSOR} --planes "impeller 1,impeller 5" {PROBES} --speeds 4000:6000:1000rpm --output w.xlsx --plot w.png
influence-no-plane          influence {ROTOR23} --planes 7,99 --sensors 2 --speeds 100
vectors                     vectors sample_data/waveforms/waveforms.toml --orders 1,2 --output runs.csv
vectors-run-up              vectors sample_data/waveforms/run_up.wav --tacho 1 --unit um --phase lag --speeds 900,2000rpm --plot tacho.png
runup-record                runup sample_data/waveforms/run_up.wav --tacho 1 --unit um --phase lag --plot bode.png
vectors-slow-roll           vectors sample_data/waveforms/slow_roll.toml
vectors-no-tacho            vectors sample_data/waveforms/run_up.wav --unit um
"""

BALANCE_COMMANDS = f"""
turbo                       balance {TURBO}/job.toml --plot corrections.png
waveforms                   balance sample_data/waveforms/job.toml
turbo-files                 balance {TURBO}/runs.csv {TURBO}/weights.csv --errors 2,2
turbo-output                balance {TURBO}/job.toml --output sheet.xlsx
turbo-output-table          balance {TURBO}/job.toml --output corrections.csv
turbo-minmax                balance {TURBO}/job.toml --method minmax --max-mass left=400,right=400
turbo-minmax-bounded        balance {TURBO}/job.toml --method minmax --max-mass 430g_mm
turbo-minmax-plain          balance {TURBO}/job.toml --method minmax
turbo-weighted              balance {TURBO}/job.toml --method weighted
turbo-weighted-limit        balance {TURBO}/job.toml --method weighted --limit "probe 4=2"
turbo-limit                 balance {TURBO}/job.toml --limit 5
turbo-limit-minmax          balance {TURBO}/job.toml --method minmax --limit "probe 1=3" --limit "probe 2=4"
turbo-weights               balance {TURBO}/job.toml --weights left=423@168.9,right=448@11.7 --limit 5
turbo-max-mass              balance {TURBO}/job.toml --max-mass 300g_mm
turbo-ridge                 balance {TURBO}/job.toml --ridge 0.05
turbo-part                  balance {TURBO}/job.toml --planes left,right --speeds 1220,3600
turbo-lag                   balance {TURBO}/job.toml --phase lag --angles "against rotation"
turbo-coarse-errors         balance {TURBO}/job.toml --errors 10,8
turbo-coarse-ridge          balance {TURBO}/job.toml --errors 10,8 --ridge 0.05
turbo-report                balance {TURBO}/job.toml --report sheet.html
checked                     balance {TURBO}/checked.toml
checked-verbose             balance {TURBO}/checked.toml --output sheet.xlsx
checked-refine              balance {TURBO}/checked.toml --refine
checked-refine-minmax       balance {TURBO}/checked.toml --refine --method minmax --report sheet.html
checked-grade               balance {TURBO}/checked.toml --planes left,right --grade G2.5 --rotor-mass 558kg --service-speed 4500rpm
checked-grade-positions     balance {TURBO}/checked.toml --planes left,right --grade G6.3 --rotor-mass 558kg --service-speed 4500rpm
holes-report                balance {TURBO}/holes.toml --split --report sheet.html
holes-plot                  balance {TURBO}/holes.toml --split --plot discs.png
holes-minmax                balance {TURBO}/holes.toml --split --method minmax
holes-unsplit               balance {TURBO}/holes.toml
model-job                   balance {MODEL_JOB}
model-job-ridge             balance {MODEL_JOB} --ridge 0.05
model-job-weighted          balance {MODEL_JOB} --method weighted --report sheet.html
computed                    balance sample_data/model_job/modelled.toml --coefficients computed
combined                    balance sample_data/model_job/modelled.toml --coefficients combined
bk                          balance sample_data/bk_two_plane/job.toml
bk-errors                   balance sample_data/bk_two_plane/job.toml --errors 2,1
bk-minmax                   balance sample_data/bk_two_plane/job.toml --method minmax
bk-weighted-no-errors       balance sample_data/bk_two_plane/job.toml --method weighted
bk-weighted                 balance sample_data/bk_two_plane/job.toml --method weighted --errors 2,1
static-couple               balance sample_data/bk_two_plane/static_couple.toml
couple-alone                balance sample_data/bk_two_plane/static_couple.toml --planes couple
no-phase                    balance sample_data/no_phase/job.toml
left-in                     balance sample_data/left_in/job.toml
rk4                         balance sample_data/rk4/job.toml
rk4-1004                    balance sample_data/rk4/job_1004.toml
rk4-few                     balance sample_data/rk4/few.toml
rk4-few-1005                balance sample_data/rk4/few_1005.toml
left-in-unknown             balance sample_data/left_in/unknown.toml
index                       balance sample_data/index/job.toml
index-machine               balance sample_data/index/machine.toml
left-in-minmax              balance sample_data/left_in/job.toml --method minmax --max-mass 10g
one-shot                    balance sample_data/calibration/later.toml
template                    balance --template job.xlsx
schema-job                  schema job
schema-rotor                schema rotor
schema-study                schema study
schema-misspelt             schema jop
balance-misspelt-column     balance misspelt.csv {TURBO}/weights.csv
balance-missing-run         balance {TURBO}/runs.csv short.csv
balance-misspelt-key        balance sample_data/turbo_job/misspelt.toml
balance-no-file             balance {TURBO}/jop.toml
balance-no-plane            balance {TURBO}/job.toml --planes left,midle
balance-ending              balance {TURBO}/job.toml --output corrections.txt
balance-undetermined        balance {TURBO}/runs.csv alike.csv --errors 2,2
unbalance-model-job         unbalance {MODEL_JOB} --stations 6,9,12,15,18
unbalance-output            unbalance {MODEL_JOB} --stations 6,12,19
unbalance-no-rotor          unbalance {TURBO}/job.toml --stations 6,12
split-holes                 split 35g@120 --holes 24 --pieces 10g,20g
split-taken                 split 35g@120 --holes 24 --pieces 10g,20g --taken 3:10g --per-hole 2 --plot s.png
split-two                   split 35g@120 --two 20g,30g
split-sum                   split 35g@120+5g@200 --holes 24
split-drill                 split 3g@120 --drill 8mm --radius 100mm
split-planes                split 35g@120+10g@30 --at 250mm,700mm --planes left=100mm,right=600mm --plot s.png
split-wrong                 split 35g120 --holes 24
tolerance                   tolerance --mass 500kg --speed 3000rpm --grade G2.5
tolerance-positions         tolerance --mass 500kg --speed 3000rpm --grade G2.5 --planes left=100mm,right=600mm --bearings 0mm,700mm --centre 320mm --plot t.png
tolerance-overhung          tolerance --mass 500kg --speed 3000rpm --grade G6.3 --planes fan=900mm,coupling=-100mm --bearings 0mm,700mm --centre 600mm
tolerance-no-grade          tolerance --mass 500kg --speed 3000rpm --grade G3
trial-weight                trial-weight --load 500kg --speed 3000rpm --radius 200mm
trial-weight-load           trial-weight --load 9kN --speed 50Hz --radius 8in --reading-phase 120 --lag below
trial-weight-model          trial-weight {MODEL_JOB} --plane middle
trial-weight-model-all      trial-weight {MODEL_JOB} --plot t.png
trial-weight-turbo          trial-weight {TURBO}/job.toml --share 30
trial-weight-nothing        trial-weight --speed 3000rpm
balance-equations           balance {TURBO}/job.toml --method least-squares --show equations --table
"""

MODEL_COMMANDS = f"""
reduce-book                 reduce {ROTOR23} --nodes 7,12,18 --modes 2 --plot reduction.png
reduce-rank                 reduce {ROTOR23} --place compromise --plot map.png
reduce-everything           reduce {ROTOR23} --nodes 7,12,18 --methods --response auto --plot response.png
reduce-errors               reduce {ROTOR23} --nodes 7,12,18 --errors compliance=1,shapes=1
reduce-compressor           reduce {COMPRESSOR} --nodes 8,14,20 --modes 1 --stability 1000:14000rpm --output small.mat
reduce-compressor-json      reduce {COMPRESSOR} --nodes 8,14,20 --modes 1 --speed 6000rpm --output small.json
reduce-compressor-response  reduce {COMPRESSOR} --nodes "impeller 1,impeller 3,impeller 5" --modes 2 --response 2000:14000:2000rpm
reduce-printed              {PRINTED} --modes 1
reduce-printed-2            {PRINTED} --modes 2
reduce-given                {GIVEN} --modes 3 --output masses.csv
reduce-given-relative       {GIVEN} --modes 2 --rows relative --nonnegative
reduce-seals                {GIVEN} --modes 2 --seals 12=2e6
reduce-model                reduce {ROTOR23} --nodes 7,12,18 --modes 2 --output three_masses.toml
reduce-force                reduce {ROTOR23} --nodes 7,12,18 --modes 2 --damping 1,0.5 --force 12 --output m.toml
reduce-report               reduce {ROTOR23} --nodes 7,12,18 --methods --report reduction.html
reduce-output               reduce {ROTOR23} --nodes 7,12,18 --modes 3 --output masses.xlsx
reduce-place-book           reduce {ROTOR23} --place book
reduce-place-best           reduce {ROTOR23} --place best --masses 2 --candidates 5,8,11,14,17,20
reduce-place-mac            reduce {ROTOR23} --place mac --masses 3 --candidates 5,8,11,14,17,20
reduce-place-compromise     reduce {ROTOR23} --place compromise --candidates 5,8,11,14,17,20 --modes 2
reduce-model-job            reduce sample_data/model_job/rotor.csv --nodes 6,12,19 --modes 2 --stability 0:9000rpm
reduce-without-nodes        reduce {ROTOR23}
reduce-order                reduce {ROTOR23} --nodes 12,7
identify-output-error       identify {IDENTIFY}/task_1_1/model.toml {IDENTIFY}/task_1_1/data.csv --errors 2,1
identify-stated             identify {IDENTIFY}/task_5_1/model.toml {IDENTIFY}/task_5_1/data.csv --errors 2,1 --output i.csv --plot i.png
identify-prior              identify prior.toml {IDENTIFY}/task_4_1/data.csv --errors 2,1
identify-report             identify {IDENTIFY}/task_3_3/model.toml {IDENTIFY}/task_3_3/data.csv --report identify.html
identify-misspelt           identify misspelt.toml {IDENTIFY}/task_5_1/data.csv
identify-no-column          identify {IDENTIFY}/task_5_1/model.toml misspelt.csv
simulate-lesson-5           simulate {IDENTIFY}/task_5_1/model.toml --with c=1000,alpha=10 --frequencies 10,20,30 --inputs F=10 --digits 2 --output x.csv
simulate-errors             simulate {IDENTIFY}/section_1_7/model.toml --with c=1e5,b=200,q=5000 --frequencies 600:1400:200rpm --inputs Ux=0.001,Uy=0.001@-90 --errors 2,1 --seed 1
simulate-modes              simulate {IDENTIFY}/task_7_1/model.toml --with c1=1e4,c2=2e4,c3=5e3 --modes --digits 3
simulate-record             simulate {FIT}/three_masses/model.toml --with c1=0.14,m1=12,m2=28 --times 0:50:2 --digits 5
simulate-record-errors      simulate {FIT}/quasilinearization/model.toml --with theta1=1,theta2=-1,theta3=-1 --times 0,1,2,3 --sigma y1=0.01,y2=0.02
simulate-resonance          simulate undamped.toml --with c=1000 --frequencies 5:15:5 --inputs F=1
simulate-missing            simulate {IDENTIFY}/task_5_1/model.toml --with c=1000 --frequencies 10 --inputs F=10
identify-modes              identify {IDENTIFY}/task_7_1/model.toml sample_data/modes/modes.csv
modes-chain                 {SHAKEN} --errors 2,1 --output modes.csv
modes-band                  {SHAKEN} --bands 24:28 --plot circles.png
modes-one-side              {SHAKEN} --bands 25:26.2
modes-no-reading            {SHAKEN} --bands 100:120Hz
fit-run-down-plot           fit {FIT}/run_down/model.toml {FIT}/run_down/record.csv --plot run_down.png
fit-quasi-method            fit {FIT}/quasilinearization/model.toml {FIT}/quasilinearization/record.csv --method quasilinearization
fit-quasi-sequential        fit {FIT}/quasilinearization/model.toml {FIT}/quasilinearization/record.csv --method quasilinearization --integrator sequential-heun --table
fit-quasi-noisy             fit {FIT}/quasilinearization/model.toml {FIT}/quasilinearization/record_noisy.csv --sigma 0.02 --output f.csv
fit-gauss-newton            fit {FIT}/quasilinearization/model.toml {FIT}/quasilinearization/record_noisy.csv --method gauss-newton --integrator rk4
fit-from-record             fit {FIT}/three_masses/from_record.toml {FIT}/three_masses/record.csv --report fit.html
fit-tolerance               fit {FIT}/quasilinearization/model.toml {FIT}/quasilinearization/record_noisy.csv --method gauss-newton --integrator rk4 --tolerance 1e-3
fit-tolerance-coarse        fit {FIT}/quasilinearization/model.toml {FIT}/quasilinearization/record_noisy.csv --method gauss-newton --tolerance 0.9
fit-tolerance-refused       fit {FIT}/quasilinearization/model.toml {FIT}/quasilinearization/record_noisy.csv --tolerance 1e-3
fit-not-measured            fit unmeasured.toml {FIT}/three_masses/record.csv
fit-no-output               fit {FIT}/quasilinearization/model.toml {FIT}/limit_cycle/record.csv
fit-prior                   fit prior.toml {FIT}/quasilinearization/record_noisy.csv --sigma 0.02
fit-prior-unweighed         fit prior.toml {FIT}/quasilinearization/record_noisy.csv
fit-ridge                   fit {FIT}/quasilinearization/model.toml {FIT}/quasilinearization/record_noisy.csv --ridge 0.001 --table
identify-equations          identify {IDENTIFY}/task_1_1/model.toml {IDENTIFY}/task_1_1/data.csv --show equations
identify-equations-lifted   identify {IDENTIFY}/task_4_2/model.toml {IDENTIFY}/task_4_2/data.csv --show equations --table
identify-equations-none     identify {IDENTIFY}/task_4_1/model.toml --show equations
reduce-equations            {GIVEN} --modes 2 --seals 12=2e6 --show equations
fit-printed                 fit {FIT}/three_masses/model.toml {FIT}/three_masses/printed.csv --allow-missing --method gauss-newton --integrator rk4
fit-equations               fit {FIT}/three_masses/model.toml {FIT}/three_masses/record.csv --show equations
"""

EXERCISES = sorted((Path(__file__).parents[2] / IDENTIFY).glob("*/data*.csv"))
RECORDS = ("limit_cycle", "quasilinearization", "run_down", "three_masses")
COMMANDS = (
    *(
        "demo",
        "critical",
        "campbell",
        "response",
        "influence",
        "bearings",
        "balance",
        "trial-weight",
        "split",
        "tolerance",
        "fleet fit",
    ),
    *(
        "unbalance",
        "study",
        "reduce",
        "identify",
        "fit",
        "simulate",
        "modes",
        "calibrate",
        "schema",
    ),
)

MODELLED = {
    "sample_data/model_job/modelled.toml": (
        MODEL_JOB,
        'runs = "runs.csv"\n',
        'runs = "../turbo_job/runs.csv"\nweights = "../turbo_job/weights.csv"\n',
    )
}
ALIKE = {
    "alike.csv": (
        f"{TURBO}/weights.csv",
        "trial 2,middle,800,0\n",
        "trial 1,middle,800,0\ntrial 2,left,400,90\ntrial 2,middle,400,90\n",
    )
}
PRIOR = {
    "prior.toml": (
        f"{FIT}/quasilinearization/model.toml",
        "[estimate]",
        "[prior]\ntheta1 = [1.0, 0.004]\ntheta2 = [-0.9, 0.02]\n\n[estimate]",
    )
}
EDITS = {
    "fit-prior": PRIOR,
    "fit-prior-unweighed": PRIOR,
    "identify-prior": {
        "prior.toml": (
            f"{IDENTIFY}/task_4_1/model.toml",
            '"delta"]',
            '"delta"]\n\n[prior]\ndelta = [0.1, 0.02]',
        )
    },
    "critical-misspelt": {"misspelt.csv": (ROTOR23, "length_m", "lenght_m")},
    "study-misspelt": {"misspelt.toml": ("sample_data/study/study.toml", "sensors.A", "senzors.A")},
    "balance-misspelt-column": {"misspelt.csv": (f"{TURBO}/runs.csv", "sensor", "senzor")},
    "identify-misspelt": {
        "misspelt.toml": (f"{IDENTIFY}/task_5_1/model.toml", "equations", "equation"),
    },
    "simulate-resonance": {
        "undamped.toml": (
            f"{IDENTIFY}/task_5_1/model.toml",
            '(m*p**2 + alpha*p + c)*X = F",\n]\nknown = { m = 10.0 }\nestimate = ["c", "alpha"]',
            '(m*p**2 + c)*X = F"]\nknown = { m = 10.0 }\nestimate = ["c"]',
        )
    },
    "balance-misspelt-key": {f"{TURBO}/misspelt.toml": (f"{TURBO}/job.toml", "[errors]", "[error]")},
    "fit-not-measured": {
        "unmeasured.toml": (
            f"{FIT}/three_masses/from_record.toml",
            "[estimate]",
            "[nuisance]\noffset = true\n[estimate]",
        ),
    },
    "identify-no-column": {"misspelt.csv": (f"{IDENTIFY}/task_5_1/data.csv", "X_re", "Y_re")},
    "balance-missing-run": {"short.csv": (f"{TURBO}/weights.csv", "trial 3", "trial 4")},
    "balance-undetermined": ALIKE,
    "computed": MODELLED,
    "combined": MODELLED,
}


def _listed(text: str, group: str) -> list[Case]:
    rows = [line.split(maxsplit=1) for line in text.strip().splitlines()]
    return [
        Case(
            name,
            command.strip(),
            group,
            edits=EDITS.get(name, {}),
        )
        for name, command in rows
    ]


def _all() -> list[Case]:
    cases = (
        _listed(ROTOR_COMMANDS, "rotor")
        + _listed(BALANCE_COMMANDS, "balance")
        + _listed(MODEL_COMMANDS, "models")
    )
    for data in EXERCISES:
        name, table = data.parent.name, data.stem
        exact = table.removeprefix("data").replace("_", "-")
        command = f"identify {IDENTIFY}/{name}/model.toml {IDENTIFY}/{name}/{table}.csv"
        cases.append(Case(f"identify-{name}{exact}", command, "models"))
    cases += [
        Case(f"fit-{name}", f"fit {FIT}/{name}/model.toml {FIT}/{name}/record.csv", "models")
        for name in RECORDS
    ]
    stored = "balance sample_data/model_job/runs.csv --influence w.json --errors 2,2"
    saved = f"balance {TURBO}/job.toml --output w"
    cases += [
        Case("turbo-stored", stored, "balance", before=(f"{saved}.json",)),
        Case("workbook-empty", "balance job.xlsx", "balance", before=("balance --template job.xlsx",)),
    ]
    fitted = "fleet fit sample_data/fleet"
    before = (f"{fitted} --output fans.parquet",)
    of_type, typed = "balance sample_data/fleet/fan-132/132-0", "--type fans.parquet:fan-132"
    cases += [
        Case("fleet-nothing", "fleet fit sample_data/motion", "fleet"),
        Case("fleet-other", f"{fitted} --type fan-123", "fleet"),
        Case("fleet-fit", fitted, "fleet"),
        Case("fleet-fit-table", f"{fitted} --output t.csv --table", "fleet"),
        Case("type", f"{of_type}9/job.toml {typed}", "fleet", before=before),
        Case("type-refined", f"{of_type}1/job.toml {typed} --refine", "fleet", before=before),
        Case("type-foreign", f"{of_type}7/job.toml {typed}", "fleet", before=before),
    ]
    cases += [Case("demo", "demo d", "demos")]
    cases += [Case(f"help-{name.replace(' ', '-')}", f"{name} --help", "usage") for name in COMMANDS]
    cases += [
        Case("help", "--help", "usage"),
        Case("version", "--version", "usage"),
        Case("no-such-command", "balence", "usage"),
        Case("no-such-option", f"critical {ROTOR23} --nubmer 3", "usage"),
        Case("no-such-choice", f"{RESPONSE} --speeds 5000rpm --view bodde", "usage"),
    ]
    return cases


CASES = {case.name: case for case in _all()}

STORED = (
    "balance-equations",
    "bearings",
    "bearings-linear",
    "calibrate-rk4",
    "campbell-compressor-coarse",
    "campbell-model-job",
    "checked-grade-positions",
    "checked-refine",
    "checked-verbose",
    "combined",
    "critical-compressor-map",
    "critical-rk4",
    "critical-rotor23",
    "demo",
    "fit-equations",
    "fit-prior",
    "fit-run-down-plot",
    "fleet-fit",
    "holes-minmax",
    "holes-report",
    "identify-equations",
    "identify-modes",
    "identify-output-error",
    "identify-task_3_3",
    "index",
    "influence-coarse",
    "left-in-unknown",
    "model-job-ridge",
    "modes-chain",
    "motion-run-up",
    "no-phase",
    "one-shot",
    "periodic-jumps",
    "reduce-book",
    "reduce-compressor-json",
    "reduce-equations",
    "reduce-errors",
    "reduce-everything",
    "reduce-force",
    "reduce-given-relative",
    "reduce-keep-supports",
    "reduce-model-job",
    "reduce-output",
    "reduce-place-mac",
    "reduce-rank",
    "response-report",
    "runup-record",
    "schema-study",
    "simulate-modes",
    "simulate-record",
    "simulate-record-errors",
    "static-couple",
    "split-drill",
    "split-holes",
    "split-planes",
    "split-sum",
    "split-two",
    "study",
    "tolerance-positions",
    "trial-weight",
    "trial-weight-model-all",
    "turbo",
    "turbo-lag",
    "turbo-limit-minmax",
    "turbo-output",
    "turbo-stored",
    "turbo-weights",
    "type",
    "type-foreign",
    "type-refined",
    "unbalance-model-job",
    "vectors-run-up",
    "waveforms",
)
"""Cases whose documents are stored: together they run what the documents of all cases run, but for the longest ones."""

REFUSED = (
    "balance-missing-run",
    "balance-misspelt-column",
    "balance-misspelt-key",
    "balance-no-file",
    "balance-ending",
    "balance-undetermined",
    "calibrate-no-bearing",
    "calibrate-says-nothing",
    "critical-misspelt",
    "critical-missing",
    "critical-two-into-one",
    "fit-no-output",
    "fit-not-measured",
    "fleet-nothing",
    "identify-misspelt",
    "identify-no-column",
    "study-misspelt",
    "trial-weight-nothing",
    "vectors-no-tacho",
    "workbook-empty",
)
"""Cases whose exit status and place of the complaint are stored."""
