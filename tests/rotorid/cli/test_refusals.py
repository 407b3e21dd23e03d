# ruff: noqa: E501 - a command line is as long as it is
"""What cannot be meant: exit status 2, one message that says what is wrong, nothing written, no traceback."""

import shlex

import pytest

from rotorid.samples import sample_data

PLACES = {
    "S": sample_data(),
    "ROTOR": sample_data() / "rotor23.csv",
    "TURBO": sample_data() / "turbo_job",
    "BK": sample_data() / "bk_two_plane/job.toml",
    "COMPRESSOR": sample_data() / "compressor/rotor.toml",
    "MOVES": sample_data() / "motion/rotor.toml",
    "BOOK": sample_data() / "book_task_9",
    "CYCLE": sample_data() / "fit/limit_cycle",
    "TASK": sample_data() / "identify/task_5_1/model.toml",
}
REFUSALS = """
critical nowhere.csv => nowhere.csv
critical {ROTOR} --plot modes.gif => .png, .svg, .pdf
critical {ROTOR} --output modes.txt => .csv, .xlsx
critical {ROTOR} --plot no/such/folder/modes.png => does not exist
critical {ROTOR} -n 0 => -n
critical {ROTOR} -n 1000 => 1000
critical => ROTOR
critical {ROTOR} --qqq => No such option: --qqq
nonsense => No such command 'nonsense'.
balanec => No such command 'balanec'. Did you mean 'balance', 'unbalance'?
-- -job.toml => No such command '-job.toml': the command stands first
balance {BK} --limt 3 => --limit, --plot, --split
motion a.csv --speed 9 --view orbist => 'orbist' is not one of 'motion', 'orbits', 'bode'. Did you mean 'orbits'?
reduce {ROTOR} --nodes 7,x => no station is called 'x'
reduce {ROTOR} --nodes 7,12,99 => node 99 does not exist
reduce {COMPRESSOR} --nodes "8,impeler 4" => no station is called 'impeler 4' (did you mean 'impeller 4'?)
reduce {ROTOR} => say where the masses stand
reduce => give a rotor, or --compliance and --measured
reduce {ROTOR} --nodes 7,12 --place best => choose one
reduce {ROTOR} --nodes 7,12 --errors alpha13=1 => 'alpha13' is not known
reduce {ROTOR} --nodes 7,12 --errors compliance => is no NAME=VALUE
reduce {ROTOR} --nodes 7,12 --errors compliance=x => compliance=x is no NAME=NUMBER
reduce {ROTOR} --nodes 7,12 --errors compliance=1,compliance=2 => stands twice
reduce {ROTOR} --nodes 7,12 --errors compliance=-1 => from 0 to 100 percent
reduce {ROTOR} --nodes 7,12 --compliance {BOOK}/compliance.csv => takes the place of a rotor
reduce {ROTOR} --nodes 7,12,18 --masses 4 => --masses does nothing without --place
reduce {ROTOR} --measured {BOOK}/modes.csv --methods => --methods compares with the computed rotor
reduce {ROTOR} --measured {BOOK}/modes.csv --nodes 7,20 => no shape was measured at 20
reduce --compliance {BOOK}/compliance.csv --measured {BOOK}/modes.csv --place mac => --place needs a rotor
reduce --compliance {BOOK}/compliance.csv --measured {BOOK}/modes.csv --seals 9=1e6 => no mass stands at '9'
reduce --compliance {BOOK}/compliance.csv --measured {BOOK}/modes.csv --modes 4 => can use 1 … 3 modes
reduce --compliance {BOOK}/compliance.csv --measured {BOOK}/modes.csv --output m.toml => say nothing of bearings
reduce {MOVES} --nodes 7,12 => reduce it with --keep-supports
reduce {ROTOR} --nodes 2,7 --keep-supports => node 2 is held rigidly while the masses are found
reduce {ROTOR} --nodes 7 --keep-supports --speed 10 => --speed asks for the rotor on its supp
reduce {ROTOR} --nodes 7,12,18 --keep-supports --output m.npz => with --keep-supports the small model is for motion
reduce --compliance {ROTOR} --measured {ROTOR} --keep-supports => --keep-supports needs a rotor
reduce {ROTOR} --nodes 7,12,18 --output m.toml --force 8 => no mass of the model stands at 8; masses stand at 7, 12, 18
influence {ROTOR} --planes 99 --sensors 1 --speeds 100 => 99
influence {ROTOR} --planes 7 --sensors 1 --speeds a:b => not a range
influence {ROTOR} --planes 7 --sensors 1 --speeds 5:1:1 => step must be positive
response {COMPRESSOR} --unbalance none.csv --speeds 500 => none.csv
response {COMPRESSOR} --unbalance api --speeds 500 --sensors prope => no station is called 'prope' (did you mean 'probe DE'?)
response {COMPRESSOR} --unbalance api --speeds 500 --sensors 2:400 => -360 to 360
response {COMPRESSOR} --unbalance api --speeds 500 --sensors 1,,2 => with commas
response {COMPRESSOR} --unbalance api:0 --speeds 500 => --unbalance
response {COMPRESSOR} --unbalance api@nowhere --speeds 500 => nowhere
campbell {COMPRESSOR} --speeds 100:200:50 --operating 9:5 => --operating '9:5' is not a range
campbell {ROTOR} --speeds 100:500:100 --cross-coupling 5:1 => --cross-coupling
campbell {ROTOR} --speeds 100:500:100 --cross-coupling 0:1e7@nowhere => nowhere
bearings {MOVES} --speeds 0:1000:500rpm => speed 0: the journal bearing 'left' at node 2 carries nothing
bearings {MOVES} --speeds 3000rpm --output linear.toml => needs two speeds at least (--speeds)
periodic {MOVES} --speeds 0:3000rpm => LOWEST:HIGHEST above 0
periodic {MOVES} --speeds 6200:6600rpm --max-seconds 0 => max-seconds
motion {MOVES} --speed 0 --time 1 => speed 0: the journal bearing 'left' at node 2
motion {MOVES} --speed 4000rpm => --time is needed
motion {MOVES} --time 1 => one of --speed and --run-up is needed
motion {MOVES} --run-up 4000rpm --time 1 => use FIRST:LAST
motion {MOVES} --speed 4000rpm --time -1 => seconds above 0
motion {MOVES} --speed 4000rpm --time 1 --displaced 12=3 => expected one of the units
motion {MOVES} --speed 4000rpm --time 1 --displaced 2=300um => touches the wall of the journal bearing 'left' at node 2 after 0 s
motion {MOVES} --speed 4000rpm --time 1 --sensors 77 => node 77 does not exist
balance => give a job
balance {TURBO}/jb.toml => (did you mean 'job.toml'?)
balance a.csv b.csv c.csv => a runs table and a weights table
balance {ROTOR} {ROTOR} => rotor23.csv
balance {TURBO}/job.toml --planes lefft => there is no plane 'lefft' (did you mean 'left'?)
balance {TURBO}/job.toml --planes "" => names with commas
balance {TURBO}/job.toml --speeds 17rpm => 17
balance {TURBO}/job.toml --phase leading => leading
balance {TURBO}/job.toml --limit "prob 4=2" => there is no sensor 'prob 4' (did you mean 'probe 4'?)
balance {TURBO}/job.toml --method minmx => 'minmx' is not known (did you mean 'minmax'?)
balance {TURBO}/job.toml --coefficients computed => rotor
balance {TURBO}/job.toml --max-mass heavy => heavy
balance {TURBO}/job.toml --ridge 0 => above 0
balance {TURBO}/job.toml --split => no plane has holes
balance {TURBO}/job.toml --refine => no check runs
balance {TURBO}/job.toml --template form.xlsx => --template, without a job
balance --template form.csv => the name must end in .xlsx
balance --template none/form.xlsx => does not exist
balance {TURBO}/holes.toml --split --ridge 0.1 => would undo
balance {TURBO}/job.toml --grade G2.5 --rotor-mass 50kg --service-speed 3000rpm => one or two planes
balance {BK} --grade G2.5 --rotor-mass 50kg --service-speed 3000rpm => radius_mm
balance {BK} --grade G3 --rotor-mass 50kg --service-speed 3000rpm => G2.5
balance {BK} --grade G2.5 => together
balance {BK} --grade G2.5 --rotor-mass heavy --service-speed 3000rpm => expected a number, such as 500kg
balance {BK} --grade G2.5 --rotor-mass 50kg --service-speed 3000 => needs its unit
unbalance {TURBO}/job.toml --stations 6 => rotor
unbalance {S}/model_job/job.toml --stations 6,6 => only once
split "35@120" --drill 8mm => expected one of the units kg, g
split 35g --drill 8mm => a weight at an angle in degrees
split 35g@500 --drill 8mm => no angle from -360 to 360
split 1e999g@1 --drill 8mm => expected a finite number
split 35g@120 => say how to mount the weight
split 0g@120 --holes 4 => there is nothing to mount
split 35g@120 --holes 4 --two 3g,4g => in one way: --holes, --two, --planes or --drill
split 3g@0+4g_mm@90 --holes 4 => cannot be added
split 35g@120 --two 20g,30g --pieces 3g => --pieces means something only with --holes
split 35g@120 --two 2g => give two weights
split 35g@120 --holes 0,90,30 => in the order of their angles
split 35g@120 --holes 0,90,90 => list each hole once
split 35g@120 --holes 0,90,360 => within one turn
split 35g@120 --holes 0 => number of equally spaced holes, 1 to 1000
split 35g@120 --holes 4 --pieces 10g,10g => listed twice
split 35g@120 --holes 4 --pieces 10g_mm => converts only with --radius
split 35g@120 --holes 4 --taken 5:10g => the number of a hole, 1 to 4
split 35g@120 --holes 2 --taken 1:3g,2:3g => nothing can be mounted
split 35g@120 --drill 8mm => --drill needs --radius
split 35g@120 --drill 8 --radius 100mm => --drill '8': expected one of the units m, mm, um, mil or in
split 35g@120 --drill 8mm --radius 100mm => use a larger drill, or share the weight (--holes)
split 35g@120 --drill 8mm --radius 1m --angles sideways => --angles 'sideways' is not known
tolerance --mass 500 --speed 3000rpm --grade G2.5 => --mass '500': expected one of the units kg, g, mg, oz or lb
tolerance --mass 0kg --speed 3000rpm --grade G2.5 => mass of the rotor must be a finite number above 0
tolerance --mass 500kg --speed 0rpm --grade G2.5 => service speed must be a finite number above 0
tolerance --mass 500kg --speed 3000 --grade G2.5 => needs its unit
tolerance --mass 500kg --speed 3000rpm --grade G3 => 'G3': the grades are G0.4
tolerance --mass 500kg --speed 3000rpm --grade G2.5 --planes left,left => left stands twice
tolerance --mass 500kg --speed 3000rpm --grade G2.5 --planes a,b,c => one or two planes, not 3
tolerance --mass 500kg --speed 3000rpm --grade G2.5 --planes a=0mm,b=100mm => needs the position of the centre of mass
tolerance --mass 500kg --speed 3000rpm --grade G2.5 --bearings 0mm => --bearings '0mm': two positions are needed
trial-weight => without a job, give --load, --speed and --radius
trial-weight --load 500kg --speed 3000rpm --radius 0mm => --radius '0mm': expected a value above 0, such as 200mm
trial-weight --load 500kg --speed 3000rpm --radius 1m --share 0 => fraction of the load must be
trial-weight --load 500kg --speed 3000rpm --radius 1m --reading-phase 120 => needs both the phase
trial-weight --load 500kg --speed 3000rpm --radius 1m --reading-phase 1 --lag high => --lag 'high': below, at or above, or degrees
trial-weight --load 500kg --speed 3000rpm --radius 1m --plane left => --plane needs a job
trial-weight --load 500kg --speed 3000rpm --radius 1m --plot x.png => no angle to draw
trial-weight {TURBO}/job.toml --speed 3000rpm => --speed is for a trial weight without a job
trial-weight {TURBO}/job.toml --plane top => no plane 'top'; the planes are 'left', 'middle', 'right'
trial-weight {TURBO}/job.toml --radius 200mm => --radius is for weights as masses
trial-weight {TURBO}/job.toml --load 0kg => --load '0kg': expected a value above 0
fit {S}/motion/small.toml {S}/fit/run_down/record.csv => `rotorid motion` follows the others
fit {CYCLE}/model.toml {CYCLE}/record.csv --start lambd=2 => 'lambd' is no parameter of the model (did you mean 'lambda'?)
fit {CYCLE}/model.toml {CYCLE}/record.csv --start lambda=nan => lambda = 'nan' is no number
fit {CYCLE}/model.toml {CYCLE}/record.csv --sigma y=1 => 'y' is no output of the model; outputs are x
fit {CYCLE}/model.toml {CYCLE}/record.csv --sigma x=-1 => x = -1 is no number above 0; use y1=0.01,y2=0.02
fit {CYCLE}/model.toml {CYCLE}/record.csv --integrator euler => --integrator 'euler' is not known
fit {CYCLE}/model.toml {CYCLE}/record.csv --tolerance 1e-3 => --tolerance belongs to --method gauss-newton or quasilinearization
fit {CYCLE}/model.toml {CYCLE}/record.csv --method gauss-newton --tolerance -2 => a number above 0, not -2
identify {S}/identify/task_4_1/model.toml {S}/identify/task_4_1/data.csv --show equation => Did you mean 'equations'?
vectors {S}/waveforms/run_up.wav --unit um => a tacho channel, without which there is no phase: --tacho NAME
vectors {S}/waveforms/run_up.wav --tacho 9 => a channel of this name
vectors {S}/waveforms/run_up.wav --tacho 1 --orders 0 => --orders takes whole numbers from 1 to 20
vectors {S}/waveforms/run_up.wav --tacho 1 --speeds 9000rpm => there is no speed of 9000 rpm
simulate {TASK} --with c=1 --frequencies 10 => --with: the value of alpha is missing
simulate {TASK} --with c=1,alpa=1 --modes => 'alpa' is no parameter of the model (did you mean 'alpha'?)
simulate {TASK} --with c=1,alpha=1 --inputs F=10 => one of --frequencies, --modes or --times
simulate {TASK} --with c=1,alpha=1 --frequencies 10 => nothing excites the model: give the amplitude of F
simulate {TASK} --with c=1,alpha=1 --inputs F=1 --modes => --inputs: 'F' is no input
simulate {TASK} --with c=1,alpha=1 --inputs F=1 --frequencies 10 --sigma 1 => --sigma does not go with --frequencies
simulate {TASK} --with c=1,alpha=1 --modes --errors 1,1 => --errors does not go with --modes
simulate {TASK} --with c=1,alpha=1 --frequencies 10 --inputs F=x => 'x' is no amplitude
simulate {TASK} --with c=1,alpha=1 --frequencies 10 --inputs F=1 --errors -1,0 => --errors '-1,0': percent
simulate {TASK} --with c=1,alpha=1 --frequencies 1 --round z:2 => --round
simulate {S}/identify/task_7_1/model.toml --with c1=1e4,c2=2e4,c3=5e3 --modes --round w:2 => --round takes z and a number of digits
simulate {S}/fit/three_masses/model.toml --with c1=0.14,m1=12,m2=28 --times 0:1:0 => --times
simulate {S}/fit/three_masses/model.toml --with c1=0.14,m1=12,m2=28 --times 0:1e9:1e-9 => --times
"""


@pytest.mark.parametrize("line", REFUSALS.strip().splitlines())
def test_what_cannot_be_meant_is_refused_in_one_message(cli, line, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    command, _, message = line.partition(" => ")
    outcome = cli(*(word.format(**PLACES) for word in shlex.split(command)))
    text = " ".join(outcome.err.replace("│", " ").split())
    assert (outcome.code, outcome.out) == (2, "")
    assert message in text
    assert "Traceback" not in text
    assert text.count("id you mean") == message.count("id you mean")
    assert not any(tmp_path.iterdir())
