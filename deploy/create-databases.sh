#!/bin/sh
# Run once by the PostgreSQL image: MLflow and Prefect each get a database beside the one for shared studies.
set -eu
for name in mlflow prefect; do
    psql --set ON_ERROR_STOP=1 --username "$POSTGRES_USER" --dbname "$POSTGRES_DB" --command "CREATE DATABASE $name"
done
