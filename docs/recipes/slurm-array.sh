#!/bin/bash
# A tree of photographs on Slurm, a part for each task of an array:
#
#   sbatch slurm-array.sh /shared/archive /shared/panoramas
#
# A task that was killed or ran out of time goes on where it was when it is queued again; a task that ends with status 3 stitched all it
# could, and /shared/panoramas/batch.csv says what it could not.
#SBATCH --job-name=trueup
#SBATCH --array=1-8
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=4
#SBATCH --mem=9G
#SBATCH --time=12:00:00
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output=trueup-%A-%a.log
exec trueup batch "$1" --output "$2" --quiet --memory 8GB \
    --threads "$SLURM_CPUS_PER_TASK" --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT"
